#pragma once
/// Pieces and velocities of what `tactus reconstruct` makes, for its JSON.
#include <nlohmann/json.hpp>
#include <optional>

#include "tactus/reconstruct/velocity.h"
#include "tactus/rig/frame_source.h"

namespace tactus {

class MotionOutput {
 public:
  explicit MotionOutput(float voxel_size_m)
      : voxel_size_m_(voxel_size_m), velocity_({.voxel_size_m = static_cast<double>(voxel_size_m)}) {}
  /// Adds `pieces` to the row of a frame, and for moving synthetic figures `velocity_rms` (of the error, m/s)
  /// and `speed_rms` (of the truth, m/s), over vertices within a voxel of the figure.
  void add(const TriangleMesh& mesh, const FrameSet& frame, const FrameSource& source, nlohmann::json& row);

 private:
  float voxel_size_m_;
  ComponentTracker tracker_;
  VelocityTracker velocity_;
  std::optional<double> last_time_s_;
};

}  // namespace tactus
