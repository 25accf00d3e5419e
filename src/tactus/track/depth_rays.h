#pragma once
/// Where the rays of a depth camera's pixels meet a posed model first.
#include <span>
#include <vector>

#include "tactus/track/outline.h"

namespace tactus {

/// Keeps its memory.
class DepthRays {
 public:
  struct Hit {
    Index x_px, y_px;
    double distance_m;  ///< along the ray
    Vec3d at_m, along;  ///< world; `along` is the ray's unit direction
    Vec3d normal;       ///< of the surface, unit
  };
  /// Row by row. Surfaces that rays graze, at less than 17 degrees, are left out: there a pixel's distance
  /// says little. @returns none where some of the model is behind the camera or nearer than 5 cm
  std::span<const Hit> find(const OutlineMesh& mesh, const Rigidd& T_world_model, const Camera& camera);

 private:
  std::vector<Vec3d> camera_m_;  ///< vertices, in the camera's frame
  std::vector<Vec2d> px_;
  std::vector<Hit> nearest_, hits_;  ///< of the pixels of a window
};

}  // namespace tactus
