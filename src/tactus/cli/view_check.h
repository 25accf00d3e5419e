#pragma once
/// Do the silhouettes of a frame agree? For `tactus reconstruct` and its JSON.
#include <nlohmann/json.hpp>
#include <string>

#include "tactus/reconstruct/hull_findings.h"
#include "tactus/reconstruct/mask_repair.h"
#include "tactus/rig/frame_source.h"

namespace tactus {

class ViewCheck {
 public:
  ViewCheck(ExecContext& ctx, const Rig& rig, const Box3f& workspace_m, bool repair);
  /// Measures the silhouettes as they came and, when asked to, repairs those of suspect views in `frame`.
  void check(ExecContext& ctx, FrameSet& frame);
  /// Adds `view_scores`, and `repairs` when there are any.
  void add_to(nlohmann::json& row) const;
  /// What the finished mesh says about rig and masks (hull_findings.h), from `views` of its row; "" when all
  /// is well. @throws Error when nothing can be right and no frame before was well.
  std::string judge(const TriangleMesh& mesh, const FrameSet& frame, const Box3f& workspace_m,
                    float voxel_size_m, const nlohmann::json& row);
  /// Which views are suspect and what was repaired; empty when all is well.
  std::string status() const;

 private:
  ViewScores scores_;
  bool repair_, was_well_ = false;
  std::vector<ViewScore> found_;
  std::vector<RepairedMask> repairs_;
};

}  // namespace tactus
