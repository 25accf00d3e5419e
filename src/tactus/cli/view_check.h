#pragma once
/// Do the silhouettes of a frame agree? For `tactus reconstruct` and its JSON.
#include <nlohmann/json.hpp>
#include <string>

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
  /// Which views are suspect and what was repaired; empty when all is well.
  std::string status() const;

 private:
  ViewScores scores_;
  bool repair_;
  std::vector<ViewScore> found_;
  std::vector<RepairedMask> repairs_;
};

}  // namespace tactus
