#include "tactus/sim/body_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tactus/geom/closest_point.h"
#include "tactus/geom/point_in_mesh.h"
#include "tactus/tissue/embedded_surface.h"

namespace tactus {
namespace {

/// In cubes: so far outside a point still counts as on the surface.
constexpr float kOnSurface = 0.1F;

OutsideBody nearest_on(const TriangleMesh& mesh, Vec3f p_m) {
  OutsideBody best{std::numeric_limits<float>::infinity(), p_m};
  const auto corner = [&](Index v) { return mesh.positions_m[static_cast<std::size_t>(v)]; };
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3f q = closest_point_on_triangle(p_m, corner(a), corner(b), corner(c));
    const float distance_m = length(p_m - q);
    if (distance_m < best.distance_m) best = {distance_m, q};
  }
  return best;
}

}  // namespace

Vec3f BodyPoint::position_m(std::span<const Vec3f> node_x_m) const {
  std::array<Vec3f, 8> corner;
  embed::CubeNodes cube;
  for (std::size_t q = 0; q < 8; ++q) {
    corner[q] = node_x_m[static_cast<std::size_t>(nodes[q])];
    cube.node[q] = static_cast<Index>(q);
  }
  const embed::Anchor anchor{0, local};
  Vec3f x;
  embed::MoveVertices{View(&anchor, 1), View<const embed::CubeNodes>(&cube, 1),
                      View<const Vec3f>(corner.data(), 8), View(&x, 1)}(0);
  return x;
}

PointInBody place_point(const BodyShape& shape, MeshFill fill, Vec3f rest_m) {
  PointInBody result;
  if (!PointInMesh(shape.surface_m, fill).inside(rest_m)) {
    const OutsideBody outside = nearest_on(shape.surface_m, rest_m);
    if (!(outside.distance_m <= kOnSurface * shape.lattice.spacing_m)) {
      result.outside = outside;
      return result;
    }
  }
  const embed::Anchor anchor = anchor_points(shape.lattice, std::span(&rest_m, 1), 1)[0];
  result.point = {shape.lattice.cube_nodes[static_cast<std::size_t>(anchor.cube)], anchor.local};
  return result;
}

}  // namespace tactus
