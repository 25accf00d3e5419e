#include "tactus/cli/output/view_check.h"

namespace tactus {

ViewCheck::ViewCheck(ExecContext& ctx, const Rig& rig, const Box3f& workspace_m, float voxel_size_m,
                     bool repair)
    : scores_(ctx, rig.cameras, {.workspace_m = workspace_m}),
      hull_check_(ctx, rig.cameras, workspace_m, voxel_size_m, !rig.depth_cameras.empty()),
      repair_(repair) {}

void ViewCheck::check(ExecContext& ctx, FrameSet& frame) {
  found_ = scores_.measure(ctx, frame.silhouettes);
  repairs_.clear();
  if (!repair_) return;
  given_ = frame.silhouettes;
  repairs_ = repair_masks(ctx, scores_, found_, frame.silhouettes);
}

void ViewCheck::add_to(nlohmann::json& row) const {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t c = 0; c < found_.size(); ++c) {
    list.push_back({{"camera", scores_.cameras()[c].name},
                    {"carved_alone", found_[c].carved_alone},
                    {"suspect", found_[c].is_suspect}});
  }
  row["view_scores"] = std::move(list);
  for (const RepairedMask& r : repairs_)
    row["repairs"].push_back({{"camera", scores_.cameras()[r.camera].name}, {"filled_px", r.filled_px}});
}

std::string ViewCheck::judge(ExecContext& ctx, const FrameSet& frame, const MeshView& surface) {
  hull_check_.submit(ctx, surface, given(frame));
  return hull_check_.judge(ctx);
}

std::string ViewCheck::status() const {
  const std::string suspect = suspect_views_text(scores_.cameras(), found_),
                    repaired = repairs_text(scores_.cameras(), repairs_);
  return suspect + (repaired.empty() ? "" : "; ") + repaired;
}

}  // namespace tactus
