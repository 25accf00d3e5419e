#pragma once
/// Notices in which substep, and at which node, a body of any model blows up.
#include "tactus/tissue/body_state.h"
#include "tactus/tissue/watch_kernels.h"

namespace tactus {

/// begin_frame, look after each substep, and at the end of the frame report. Nothing is read back before
/// that.
class BodyWatch {
 public:
  BodyWatch(ExecContext& ctx, Index nodes)
      : records_(ctx.device(), ceil_div(nodes, Index{WatchNodes::kThreads})) {
    begin_frame(ctx);
  }
  void begin_frame(ExecContext& ctx) {
    ctx.parallel_for("watch/clear", records_.size(), ClearRecords{records_.view()});
  }
  void look(ExecContext& ctx, const BodyState& state, Index substep) {
    ctx.parallel_for("watch/nodes", records_.size(),
                     WatchNodes{state.x_m.const_view(), state.v_m_s.const_view(), records_.view(), substep});
  }
  /// The earliest bad node, of several the lowest, and the fastest of the others. Synchronizes.
  WatchRecord report(ExecContext& ctx) const {
    WatchRecord all;
    for (const WatchRecord& r : to_host(ctx, records_.const_view())) {
      if (r.bad_substep >= 0 && (all.bad_substep < 0 || r.bad_substep < all.bad_substep)) {
        all.bad_substep = r.bad_substep;
        all.bad_node = r.bad_node;
      }
      if (r.fastest2_m2_s2 > all.fastest2_m2_s2) {
        all.fastest2_m2_s2 = r.fastest2_m2_s2;
        all.fastest_node = r.fastest_node;
      }
    }
    return all;
  }

 private:
  Buffer<WatchRecord> records_;
};

}  // namespace tactus
