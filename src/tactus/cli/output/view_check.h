#pragma once
/// Do the silhouettes of a frame agree? For `tactus reconstruct` and its JSON.
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "tactus/reconstruct/doctor/mask_repair.h"
#include "tactus/reconstruct/hull_check.h"
#include "tactus/rig/sources/frame_source.h"

namespace tactus {

class ViewCheck {
 public:
  ViewCheck(ExecContext& ctx, const Rig& rig, const Box3f& workspace_m, float voxel_size_m, bool repair);
  /// Measures the silhouettes as they came and, when asked to, repairs those of suspect views in `frame`.
  void check(ExecContext& ctx, FrameSet& frame);
  /// The masks of that frame as they came.
  std::span<const BitMask> given(const FrameSet& frame) const {
    return repairs_.empty() ? frame.silhouettes : given_;
  }
  /// Adds `view_scores`, and `repairs` when there are any.
  void add_to(nlohmann::json& row) const;
  /// Findings of the finished surface about rig and masks (hull_findings.h); "" when all is well.
  /// @throws Error when nothing can be right and no frame before was well.
  std::string judge(ExecContext& ctx, const FrameSet& frame, const MeshView& surface);
  /// The suspect views and the repairs; empty when all is well.
  std::string status() const;

 private:
  ViewScores scores_;
  HullCheck hull_check_;
  bool repair_;
  std::vector<ViewScore> found_;
  std::vector<RepairedMask> repairs_;
  std::vector<BitMask> given_;  ///< when masks were repaired
};

}  // namespace tactus
