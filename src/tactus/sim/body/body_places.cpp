#include "tactus/sim/body/body_places.h"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "tactus/sim/body/body_shape.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {

std::string BodyPlaces::node_text(Index node) const {
  const Vec3f p = shape_.lattice.rest_m(node);
  char text[96];
  std::snprintf(text, sizeof text, "node %d, at rest at (%.3f, %.3f, %.3f) m", node, static_cast<double>(p.x),
                static_cast<double>(p.y), static_cast<double>(p.z));
  return text;
}

std::string BodyPlaces::cube_text(Index cube) const {
  const Vec3f p = cube_center_m(cube);
  char text[96];
  std::snprintf(text, sizeof text, "cube %d, at rest round (%.3f, %.3f, %.3f) m", cube,
                static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
  const std::uint8_t material = shape_.material_of_cube[static_cast<std::size_t>(cube)];
  const std::string region = material == 0 ? "" : description_.regions[material - 1U].name;
  return text + (region.empty() ? "" : " in region '" + region + "'");
}

Vec3f BodyPlaces::cube_center_m(Index cube) const {
  const CubeLattice& lattice = shape_.lattice;
  return lattice.origin_m +
         lattice.spacing_m *
             (vec_cast<float>(lattice.cubes[static_cast<std::size_t>(cube)]) + Vec3f{0.5F, 0.5F, 0.5F});
}

std::string BodyPlaces::acting_near(Vec3f p_m) const {
  const CubeLattice& lattice = shape_.lattice;
  float nearest_m = std::numeric_limits<float>::infinity();
  std::string text;
  // Names all causes that are equally near.
  const auto add = [&](const std::vector<Index>& nodes, const std::string& what) {
    float least_m = std::numeric_limits<float>::infinity();
    for (const Index node : nodes) least_m = std::min(least_m, length(lattice.rest_m(node) - p_m));
    if (nodes.empty() || least_m > nearest_m) return;
    text = (least_m < nearest_m || text.empty() ? "" : text + ", ") + what;
    nearest_m = least_m;
  };
  for (const NodeMotion& motion : shape_.motions) {
    char speed[48];
    std::snprintf(speed, sizeof speed, " moves it, at up to %.3g m/s",
                  fastest_move(lattice, motion).speed_m_s);
    add(motion.nodes, motion.name + speed);
  }
  for (std::size_t k = 0; k < shape_.loads.size(); ++k)
    add(tissue_.boundary().loads().nodes_of(k), shape_.loads[k].name + " acts on it");
  // Fixed nodes far away are no cause of an event here, and places for nodes of cuts don't move, either.
  const Index regular = lattice.node_count() - static_cast<Index>(lattice.virtual_nodes.size());
  std::vector<Index> fixed;
  for (Index i = 0; i < regular; ++i)
    if (lattice.fixed[static_cast<std::size_t>(i)] != 0 &&
        length(lattice.rest_m(i) - p_m) < 3.5F * lattice.spacing_m)
      fixed.push_back(i);
  add(fixed, "'fixed' holds it");
  add(points_.touched(), "the real surface or an obstacle touches it");
  if (text.empty() || nearest_m < 0.9F * lattice.spacing_m) return text;
  char distance[48];
  std::snprintf(distance, sizeof distance, ", %.3g m from there", static_cast<double>(nearest_m));
  return text + distance;
}

}  // namespace tactus
