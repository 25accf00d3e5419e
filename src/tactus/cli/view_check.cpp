#include "tactus/cli/view_check.h"

#include <algorithm>

#include "tactus/base/error.h"

namespace tactus {

ViewCheck::ViewCheck(ExecContext& ctx, const Rig& rig, const Box3f& workspace_m, bool repair)
    : scores_(ctx, rig.cameras, {.workspace_m = workspace_m}), repair_(repair) {}

void ViewCheck::check(ExecContext& ctx, FrameSet& frame) {
  found_ = scores_.measure(ctx, frame.silhouettes);
  repairs_.clear();
  if (repair_) repairs_ = repair_masks(ctx, scores_, found_, frame.silhouettes);
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

std::string ViewCheck::judge(const TriangleMesh& mesh, const FrameSet& frame, const Box3f& workspace_m,
                             float voxel_size_m, const nlohmann::json& row) {
  const std::span<const Camera> cameras = scores_.cameras();
  HullQuality quality{static_cast<Index>(mesh.positions_m.size()), false, 0,
                      std::vector<ViewQuality>(cameras.size())};
  std::size_t masks = 0, with_content = 0;
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (frame.silhouettes[c].words.empty()) continue;
    const bool any = frame.silhouettes[c].area_px() > 0;
    ++masks;
    with_content += any ? 1U : 0U;
    for (const nlohmann::json& view : row["views"]) {
      if (any && view["camera"] == cameras[c].name)
        quality.views[c] = {true, view["recall"].get<double>(), view["iou"].get<double>()};
    }
  }
  quality.something_seen = 2 * with_content > masks;
  std::size_t on_faces = 0;
  const float near_m = 0.5F * voxel_size_m;
  for (const Vec3f p : mesh.positions_m) {
    bool on = false;
    for (int i = 0; i < 3; ++i)
      on |= p[i] < workspace_m.min[i] + near_m || p[i] > workspace_m.max[i] - near_m;
    on_faces += on ? 1U : 0U;
  }
  quality.on_faces =
      static_cast<double>(on_faces) / static_cast<double>(std::max<std::size_t>(mesh.positions_m.size(), 1));
  std::vector<HullFinding> found = judge_hull(cameras, quality, workspace_m);
  if (any_fatal(found) && !was_well_) throw Error(findings_text(found));
  was_well_ |= quality.something_seen && !any_fatal(found);
  for (HullFinding& f : find_pieces_seen_by_few(cameras, mesh, few_cameras(cameras.size())))
    found.push_back(std::move(f));
  return findings_text(found);
}

std::string ViewCheck::status() const {
  const std::string suspect = suspect_views_text(scores_.cameras(), found_),
                    repaired = repairs_text(scores_.cameras(), repairs_);
  return suspect + (repaired.empty() ? "" : "; ") + repaired;
}

}  // namespace tactus
