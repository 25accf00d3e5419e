#pragma once
/// How photographs are chosen for points of a surface: the numbers that the compute pass (reconstruct) and
/// the fragment shader (view) share.
///
/// A camera's score is s_j = f_j / (1 - cos θ_j + ε), θ_j the angle between its optical axis and the viewing
/// direction (Shao et al. 2019, "Texture mapping"; weights after Buehler et al. 2001, "Unstructured lumigraph
/// rendering"); f_j falls to 0 at grazing view, at the image's border and where something hides the point.
/// The best k are blended with weights s_j - s_(k+1), which are 0 for a camera that is about to leave the
/// best k: no seams pop up when the viewer moves. k = 1 is the paper: among the cameras that see the point
/// the one with the smallest θ_j.
#include <algorithm>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/camera/camera_bits.h"

namespace tactus {

struct PhotoChoice {
  static constexpr int kMostBlended = 16;                          ///< largest k
  static constexpr float kLeastCosine = 0.2F, kFullCosine = 0.5F;  ///< f_j's ramp over the angle of view
  static constexpr float kBorderPx = 16;                           ///< f_j's ramp at the image's border
  static constexpr float kOutlineWeight =
      0.001F;                                 ///< f_j near the body's outline: a photo shows the wall, too
  static constexpr float kEpsilon = 0.01F;    ///< ε: cameras within 8 degrees are about equally good
  static constexpr float kBiasVoxels = 0.5F;  ///< a surface that much nearer hides the point

  /// Pixels of a texel of a camera's map of occluders: a voxel in the middle of the workspace, at least 4
  /// (as far from the outline of a real body photos mix in the wall). Nearer ones look larger, up to 1.5
  /// texels at two thirds of that distance, and a map of vertices, once widened, still has no holes.
  static float texel_px(const Camera& camera, float voxel_size_m, Vec3f center_m) {
    const double distance = length(camera.center_world() - vec_cast<double>(center_m));
    const double voxel_px = camera.fx_px * static_cast<double>(voxel_size_m) / std::max(distance, 1e-3);
    return static_cast<float>(std::clamp(voxel_px, 4.0, 64.0));
  }
};

}  // namespace tactus
