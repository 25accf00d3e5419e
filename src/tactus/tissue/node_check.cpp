#include "tactus/tissue/node_check.h"

#include "tactus/tissue/summary_kernels.h"

namespace tactus {

NodeCheck::NodeCheck(ExecContext& ctx, Index nodes)
    : records_(ctx.device(), ceil_div(nodes, Index{CheckNodes::kThreads})), summary_(ctx.device(), 1) {
  begin_frame(ctx);
}

void NodeCheck::begin_frame(ExecContext& ctx) {
  ctx.parallel_for("node check/clear", records_.size(), ClearRecords{records_.view()});
}

void NodeCheck::check(ExecContext& ctx, const Count& nodes, View<const Vec3f> x_m, View<const Vec3f> v_m_s,
                      View<const Index> only_matched, Index substep, View<const FrameParams> frame,
                      Index every) {
  ctx.parallel_for(
      "node check/nodes", records_.size(),
      CheckNodes{nodes, x_m, v_m_s, only_matched, {}, {}, records_.view(), substep, frame, every});
}

void NodeCheck::check(ExecContext& ctx, View<const Index> cell, const NodeFields& fields, Index substep,
                      View<const FrameParams> frame, Index every) {
  ctx.parallel_for("node check/nodes", records_.size(),
                   CheckNodes{cell.size(), {}, {}, {}, cell, fields, records_.view(), substep, frame, every});
}

void NodeCheck::summarise(ExecContext& ctx) {
  ctx.parallel_for("node check/summarise", 1, SummariseNodeCheck{records_.const_view(), summary_.view()});
}

}  // namespace tactus
