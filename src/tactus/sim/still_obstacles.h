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

/// The lower face of the liquid's box, where it is closed.
inline constexpr const char* kLiquidFloorName = "floor of 'fluid.box'";

/// Boxes, spheres and meshes, in the scene's order; for planes stands the ground of the picture. Then a plate
/// for the floor of the liquid's box, where that isn't on the ground.
std::vector<StillObstacle> still_obstacles(const Scene& scene, const BodyAssets& assets);

}  // namespace tactus
