#pragma once
/// Notices in which substep, and at which node, a body of any model blows up.
#include "tactus/compute/exec_context.h"
#include "tactus/tissue/summary_kernels.h"

namespace tactus {

/// begin_frame, check after each substep, and at the end of the frame report. Nothing is read back before
/// that.
class NodeCheck {
 public:
  NodeCheck(ExecContext& ctx, Index nodes)
      : records_(ctx.device(), ceil_div(nodes, Index{CheckNodes::kThreads})), summary_(ctx.device(), 1) {
    begin_frame(ctx);
  }
  void begin_frame(ExecContext& ctx) {
    ctx.parallel_for("node check/clear", records_.size(), ClearRecords{records_.view()});
  }
  /// @param nodes the first so many are looked at @param only_matched per node: 1: in no element; empty: all
  /// are
  /// @param frame when given, `substep` counts in a recorded block, and nodes are looked at after every so
  /// many of the frame's substeps and after the last
  void check(ExecContext& ctx, const Count& nodes, View<const Vec3f> x_m, View<const Vec3f> v_m_s,
             View<const Index> only_matched, Index substep, View<const FrameParams> frame = {},
             Index every = 1) {
    ctx.parallel_for(
        "node check/nodes", records_.size(),
        CheckNodes{nodes, x_m, v_m_s, only_matched, {}, {}, records_.view(), substep, frame, every});
  }
  /// The same for nodes that are in cells.
  void check(ExecContext& ctx, View<const Index> cell, const NodeFields& fields, Index substep,
             View<const FrameParams> frame, Index every) {
    ctx.parallel_for(
        "node check/nodes", records_.size(),
        CheckNodes{cell.size(), {}, {}, {}, cell, fields, records_.view(), substep, frame, every});
  }
  /// Finds the earliest bad node, of several the lowest, and the fastest of the others. Asynchronous.
  void summarise(ExecContext& ctx) {
    ctx.parallel_for("node check/summarise", 1, SummariseNodeCheck{records_.const_view(), summary_.view()});
  }
  /// (1) Result of summarise().
  View<const NodeCheckRecord> summary() const { return summary_.const_view(); }

 private:
  Buffer<NodeCheckRecord> records_, summary_;
};

}  // namespace tactus
