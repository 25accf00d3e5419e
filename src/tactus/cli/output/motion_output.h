#pragma once
/// Components and velocities of the meshes that `tactus reconstruct` makes, for its JSON.
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "tactus/contact/real/real_surface.h"
#include "tactus/reconstruct/components.h"
#include "tactus/reconstruct/visual_hull.h"
#include "tactus/rig/sources/frame_source.h"

namespace tactus {

class MotionOutput {
 public:
  MotionOutput(ExecContext& ctx, float voxel_size_m) : ctx_(ctx), voxel_size_m_(voxel_size_m) {}
  /// Adds `components` to the row of a frame, and for moving synthetic figures `velocity_rms` (of the error,
  /// m/s) and `speed_rms` (of the truth, m/s), over vertices within a voxel of the figure.
  /// @param mesh the surface on the host
  void add(const MeshView& surface, const TriangleMesh& mesh, const FrameSet& frame,
           const FrameSource& source, nlohmann::json& row);

 private:
  /// Follows the surface's components. @return the number of each vertex's component, or kNoComponent
  std::vector<Index> track(const MeshView& surface, const TriangleMesh& mesh, double dt_s);
  nlohmann::json describe(MeshComponent component, Index tracked);

  ExecContext& ctx_;
  float voxel_size_m_;
  std::optional<RealSurface> tracker_;  ///< with capacity for the meshes so far
  RealSurfaceReport report_;
  std::map<Index, Mat3d> axes_;  ///< of each label, when it was seen last
  std::optional<double> last_time_s_;
};

}  // namespace tactus
