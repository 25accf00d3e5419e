#include "tactus/sim/body/body_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tactus/base/error.h"
#include "tactus/geom/mesh/closest_point.h"
#include "tactus/geom/mesh/point_in_mesh.h"
#include "tactus/tissue/embed_kernels.h"
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
  embed::CubeNodes corners;
  for (std::size_t q = 0; q < 8; ++q) {
    corner[q] = node_x_m[static_cast<std::size_t>(nodes[q])];
    corners.node[q] = static_cast<Index>(q);
  }
  const embed::Anchor anchor{0, local};
  Vec3f x;
  embed::MoveVertices{View(&anchor, 1), View<const embed::CubeNodes>(&corners, 1),
                      View<const Vec3f>(corner.data(), 8), View(&x, 1)}(0);
  return x;
}

CubeStrain StrainAtPoint::mean(std::span<const CubeStrain> of_cubes) const {
  CubeStrain sum{Mat3d::zero(), Mat3d::zero(), 0};
  for (std::size_t k = 0; k < cubes.size(); ++k) {
    sum.strain = sum.strain + strain_weight[k] * of_cubes[k].strain;
    sum.stress_Pa = sum.stress_Pa + stress_weight[k] * of_cubes[k].stress_Pa;
    sum.J += strain_weight[k] * of_cubes[k].J;
  }
  return sum;
}

StrainAtPoint strain_at_point(const BodyShape& shape, const BodyPoint& point) {
  const CubeLattice& lattice = shape.lattice;
  StrainAtPoint at;
  std::vector<std::vector<std::pair<std::size_t, double>>> of_node(8);  // cubes round it, fill
  for (Index c = 0; c < lattice.regular_cubes(); ++c) {
    const auto& corners = lattice.cube_nodes[static_cast<std::size_t>(c)];
    bool is_near = false;
    for (std::size_t q = 0; q < 8; ++q) {
      if (std::find(corners.begin(), corners.end(), point.nodes[q]) == corners.end()) continue;
      const float fill = lattice.cube_fill.empty() ? 1.F : lattice.cube_fill[static_cast<std::size_t>(c)];
      of_node[q].emplace_back(at.cubes.size(), double{fill});
      is_near = true;
    }
    if (is_near) at.cubes.push_back(c);
  }
  const auto is_element = [&](std::size_t k) {
    return shape.elements.empty() || shape.elements[static_cast<std::size_t>(at.cubes[k])] != 0;
  };
  const auto weights = [&](auto&& counts) {
    std::vector<double> weight(at.cubes.size());
    double all = 0;
    for (std::size_t q = 0; q < 8; ++q) {
      double of_point = 1, sum = 0;
      for (int a = 0; a < 3; ++a)
        of_point *= (q >> a & 1) != 0 ? double{point.local[a]} : 1 - double{point.local[a]};
      for (const auto& [k, fill] : of_node[q]) sum += counts(k) ? fill : 0;
      if (!(sum > 0)) continue;
      all += of_point;
      for (const auto& [k, fill] : of_node[q]) weight[k] += counts(k) ? of_point * fill / sum : 0;
    }
    for (double& w : weight) w /= all > 0 ? all : 1;
    return weight;
  };
  at.strain_weight = weights([](std::size_t) { return true; });
  at.stress_weight = weights(is_element);
  return at;
}

std::string point_text(Vec3d p_m) {
  const auto text = [](double x) { return number_text(std::round(x * 1e6) / 1e6 + 0.0); };
  return "[" + text(p_m.x) + ", " + text(p_m.y) + ", " + text(p_m.z) + "]";
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
  result.point = {shape.lattice.cube_nodes[static_cast<std::size_t>(anchor.cube)], anchor.local, anchor.cube};
  return result;
}

}  // namespace tactus
