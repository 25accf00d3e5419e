#pragma once
/// A run as one file that moves.
#include "tactus/io/usd_file.h"
#include "tactus/run/frame_sink.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// Every so many frames (`output.usd_every`) all that is seen: the real surface, bodies, obstacles,
/// blades and particles, in STEM.usda once the run has ended.
class UsdSink final : public FrameSink {
 public:
  /// @param frames_per_s of the run
  UsdSink(const Scene& scene, const BodyAssets& assets, const std::string& stem, double frames_per_s);
  /// @throws Error when the disk is full.
  void frame(RunFrame& frame) override;
  void end(RunNotices& notices) override;

 private:
  Scene scene_;
  int every_;  ///< frames
  UsdWriter usd_;
  std::vector<std::string> moving_;  ///< names of obstacles, in the order of snapshots
  int time_code_ = 0;
};

}  // namespace tactus
