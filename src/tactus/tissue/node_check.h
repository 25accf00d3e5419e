#pragma once
/// Notices in which substep, and at which node, a body of any model blows up.
#include "tactus/compute/exec_context.h"
#include "tactus/frame/frame_params.h"
#include "tactus/geom/arrays/vector_fields.h"
#include "tactus/tissue/node_check_record.h"

namespace tactus {

/// begin_frame, check after each substep, and at the end of the frame report. Nothing is read back before
/// that.
class NodeCheck {
 public:
  NodeCheck(ExecContext& ctx, Index nodes);
  void begin_frame(ExecContext& ctx);
  /// @param nodes the first so many are looked at @param only_matched per node: 1: in no element; empty: all
  /// are
  /// @param frame when given, `substep` counts in a recorded block, and nodes are looked at after every so
  /// many of the frame's substeps and after the last
  void check(ExecContext& ctx, const Count& nodes, View<const Vec3f> x_m, View<const Vec3f> v_m_s,
             View<const Index> only_matched, Index substep, View<const FrameParams> frame = {},
             Index every = 1);
  /// The same for nodes that are in cells.
  void check(ExecContext& ctx, View<const Index> cell, const NodeFields& fields, Index substep,
             View<const FrameParams> frame, Index every);
  /// Finds the earliest bad node, of several the lowest, and the fastest of the others. Asynchronous.
  void summarise(ExecContext& ctx);
  /// (1) Result of summarise().
  View<const NodeCheckRecord> summary() const { return summary_.const_view(); }

 private:
  Buffer<NodeCheckRecord> records_, summary_;
};

}  // namespace tactus
