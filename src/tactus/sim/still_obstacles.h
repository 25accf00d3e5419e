#pragma once
/// Surfaces of a scene's obstacles that stand still.
#include <string>
#include <vector>

#include "tactus/geom/mesh/mesh.h"
#include "tactus/sim/body/body_shape.h"

namespace tactus {

struct StillObstacle {
  std::string name;
  TriangleMesh mesh;  ///< world [m]; boxes are flat-shaded and have no normals
};

/// Boxes, spheres and meshes, in the scene's order; for planes stands the ground of the picture.
std::vector<StillObstacle> still_obstacles(const Scene& scene, const BodyAssets& assets);

}  // namespace tactus
