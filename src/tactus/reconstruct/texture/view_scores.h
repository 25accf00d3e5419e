#pragma once
/// Consistency of the silhouettes of one frame: which camera carves space that all others keep. A hole in one
/// mask, a camera that was pushed, or one that is late carve tunnels and slabs out of the inside of the
/// others' hull; good masks only shave its skin.
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/reconstruct/texture/view_score_kernels.h"

namespace tactus {

struct ViewScore {
  double carved_alone =
      0;  ///< volume inside the others' hull that this view alone carves, over the hull's own
  bool is_suspect = false;
};

struct ViewScoreOptions {
  Box3f workspace_m;
  Index samples = 48;  ///< along the longest side of the workspace, 8 to 512
  /// A view is suspect when it carves more than this share of the hull alone, ...
  double least_share = 0.03;
  /// ... and more than that many times the share of the view in the middle of the ranking.
  double times_median = 4;
};

class ViewScores {
 public:
  /// @throws Error: no or more than 64 cameras, a bad camera, an empty workspace, an option out of range.
  ViewScores(ExecContext& ctx, std::span<const Camera> cameras, const ViewScoreOptions& options);
  /// Scores of one tick, one per camera; waits for the device. An empty mask (0x0) carves nothing.
  /// @throws Error when a size contradicts its camera.
  std::vector<ViewScore> measure(ExecContext& ctx, std::span<const BitMask> silhouettes);
  /// Where this view carves alone, by the last `measure`: the samples that its score counts, in groups that
  /// touch (faces, edges, corners), world frame. Waits for the device.
  std::vector<std::vector<Vec3f>> carved_alone_m(ExecContext& ctx, Index view);

  std::span<const Camera> cameras() const { return cameras_; }
  float spacing_m() const { return spacing_m_; }  ///< of the samples

 private:
  std::vector<Camera> cameras_;
  ViewScoreOptions options_;
  std::vector<ScoreCamera> layout_;
  Vec3i samples_{};
  float spacing_m_ = 0;
  Buffer<ScoreCamera> device_cameras_;
  HostBuffer<std::uint32_t> staging_;
  Buffer<std::uint32_t> masks_, counts_;
  Buffer<std::int8_t> blame_;
};

/// "camera 'x' carves 9.1 % of the hull that all other views keep"; empty when no view is suspect.
std::string suspect_views_text(std::span<const Camera> cameras, std::span<const ViewScore> scores);

}  // namespace tactus
