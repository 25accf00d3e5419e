#include "tactus/geom/mesh/sphere_surface.h"

#include <cmath>

#include "tactus/geom/mesh/box_surface.h"

namespace tactus {

/// A cube blown up. Its squares would be smaller at the corners; the tangent makes them nearly equal.
TriangleMesh sphere_surface(float radius_m, Index n) {
  TriangleMesh mesh = box_surface({1, 1, 1}, {static_cast<int>(n), static_cast<int>(n), static_cast<int>(n)});
  const auto spread = [](float x) { return std::tan(static_cast<float>(M_PI) / 4 * x); };
  for (Vec3f& p : mesh.positions_m) p = normalized(Vec3f{spread(p.x), spread(p.y), spread(p.z)});
  mesh.normals = mesh.positions_m;
  constexpr double kBall = 4 * M_PI / 3;
  const auto scale = radius_m * static_cast<float>(std::cbrt(kBall / volume_m3(mesh)));
  for (Vec3f& p : mesh.positions_m) p *= scale;
  return mesh;
}

}  // namespace tactus
