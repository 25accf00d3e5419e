#include "tactus/tissue/tled/tile_plan.h"

#include <algorithm>
#include <string>

#include "tactus/base/error.h"

namespace tactus::tled {
namespace {

constexpr Index kLanes = 8;
std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Number and shape of the tiles along each axis.
struct TileShape {
  Index groups, rows, layers;
  Index own_x() const { return groups * kLanes - 1; }
  Index own_y() const { return rows - 1; }
};

/// @param nodes own ones along each axis
TileShape choose_shape(Vec3i nodes, Index max_groups, Index max_groups_x, Index layers) {
  TileShape best{1, max_groups, layers};
  double least = 1e30;
  for (Index groups = 1; groups <= max_groups_x; ++groups) {
    const Index most_rows = max_groups / groups;
    const Index tiles_y = ceil_div(nodes.y, most_rows - 1), rows = ceil_div(nodes.y, tiles_y) + 1;
    const double work = static_cast<double>(ceil_div(nodes.x, groups * kLanes - 1)) * groups * tiles_y * rows;
    if (work < least) {
      least = work;
      best = {groups, rows, ceil_div(nodes.z, ceil_div(nodes.z, layers))};
    }
  }
  return best;
}

Grid make_grid(Vec3i nodes, const TileShape& shape) {
  const auto padded = [](Index n, Index own) { return static_cast<double>(ceil_div(n, own)) * own + 2; };
  const double x = padded(nodes.x, shape.own_x()) + kLanes, y = padded(nodes.y, shape.own_y()),
               z = padded(nodes.z, shape.layers);
  if (3 * x * y * z > 2e9) {
    throw Error("the body's box of " + std::to_string(nodes.x) + "x" + std::to_string(nodes.y) + "x" +
                std::to_string(nodes.z) + " nodes needs " + bytes_text(36 * x * y * z) +
                ", more than one device can index; use a larger spacing");
  }
  Grid grid;
  grid.stride_y = static_cast<Index>(x);
  grid.stride_z = static_cast<Index>(x * y);
  grid.first = 1 + grid.stride_y + grid.stride_z;
  // Columns read the nodes one further along x and y than their cubes.
  grid.cells = static_cast<Index>(x * y * z) + grid.stride_y + kLanes;
  return grid;
}

}  // namespace

TilePlan plan_tiles(const CubeLattice& lattice, const std::vector<std::uint8_t>& in_use, Index max_groups,
                    Index max_groups_x, Index layers, Slab own) {
  const Vec3i n = lattice.node_dims;
  const TileShape shape = choose_shape({n.x, n.y, own.count()}, max_groups, max_groups_x, layers);
  TilePlan plan;
  plan.grid = make_grid(n, shape);
  for (const Vec3i p : lattice.nodes) plan.node_cell.push_back(plan.grid.cell(p));
  for (const Vec3i p : lattice.cubes) plan.cube_cell.push_back(plan.grid.cell(p));

  const Vec3i tiles{ceil_div(n.x, shape.own_x()), ceil_div(n.y, shape.own_y()),
                    ceil_div(own.count(), shape.layers)};
  const auto tile_count = at(tiles.x * tiles.y * tiles.z);
  const Index masks = shape.layers + 1;
  std::vector<std::uint8_t> used(tile_count);
  std::vector<std::uint32_t> mask(tile_count * at(masks));
  const auto tile_index = [&](Vec3i t) { return at((t.z * tiles.y + t.y) * tiles.x + t.x); };
  // A cube takes part in every tile that owns one of its corners: at most 8.
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!in_use.empty() && in_use[c] == 0) continue;
    const Vec3i p = lattice.cubes[c] - Vec3i{0, 0, own.begin};
    if (p.z + 1 < 0 || p.z >= own.count()) continue;
    const Vec3i low{p.x / shape.own_x(), p.y / shape.own_y(), std::max(p.z, 0) / shape.layers};
    const Vec3i high{(p.x + 1) / shape.own_x(), (p.y + 1) / shape.own_y(), (p.z + 1) / shape.layers};
    for (Index z = low.z; z <= high.z; ++z)
      for (Index y = low.y; y <= high.y; ++y)
        for (Index x = low.x; x <= high.x; ++x) {
          if (x >= tiles.x || y >= tiles.y || z >= tiles.z) continue;
          const Vec3i column =
              p + Vec3i{1, 1, 1} - Vec3i{x * shape.own_x(), y * shape.own_y(), z * shape.layers};
          used[tile_index({x, y, z})] = 1;
          mask[tile_index({x, y, z}) * at(masks) + at(column.z)] |=
              1U << (column.y * shape.groups + column.x / kLanes);
        }
  }
  const auto add_layer_of_tiles = [&](Index z) {
    const Index begin = own.begin + z * shape.layers;
    for (Index y = 0; y < tiles.y; ++y)
      for (Index x = 0; x < tiles.x; ++x) {
        const std::size_t i = tile_index({x, y, z});
        if (used[i] == 0) continue;
        const Vec3i low{x * shape.own_x(), y * shape.own_y(), begin};
        plan.tiles.push_back({plan.grid.cell(low - Vec3i{1, 1, 1}), shape.groups, shape.rows,
                              std::min(shape.layers, own.end - begin),
                              static_cast<Index>(plan.active.size())});
        plan.active.insert(plan.active.end(), mask.begin() + static_cast<std::ptrdiff_t>(i * at(masks)),
                           mask.begin() + static_cast<std::ptrdiff_t>((i + 1) * at(masks)));
      }
  };
  const auto is_edge = [&](Index z) {
    return (z == 0 && own.begin > 0) || (z == tiles.z - 1 && own.end < n.z);
  };
  for (Index z = 0; z < tiles.z; ++z)
    if (is_edge(z)) add_layer_of_tiles(z);
  plan.edge_tiles = static_cast<Index>(plan.tiles.size());
  for (Index z = 0; z < tiles.z; ++z)
    if (!is_edge(z)) add_layer_of_tiles(z);
  return plan;
}

}  // namespace tactus::tled
