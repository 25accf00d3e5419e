#include "tactus/tissue/tled/tile_plan.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <span>
#include <string>

#include "tactus/base/error.h"

namespace tactus::tled {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Tiles with the same nodes along x: those of one segment of rows. Where fewer nodes are left, there is room
/// for more rows.
struct TileColumn {
  Index begin_x = 0;  ///< first own node
  Index shares = 0;   ///< Tile's
  Index groups = 0, rows = 0;
  Index tiles_y = 0;
  Index first_tile = 0;  ///< of all tiles of a layer
  Index own_y() const { return rows - 1; }
  Index first_x() const { return begin_x - shares; }
};

struct Tiling {
  Index width = 0;  ///< columns of cubes per tile along x, but for the last; all but the first share one
  Index layers = 0, tiles_z = 0;
  std::vector<TileColumn> columns;
  Index tiles_per_layer() const { return columns.back().first_tile + columns.back().tiles_y; }
  Index masks() const { return layers + 1; }
  Index column_of(Index node_x) const { return (node_x - 1) / (width - 1); }
};

/// @param nodes own ones along each axis
Tiling tile(Vec3i nodes, const TileLimits& limits, Index groups) {
  Tiling tiling{.width = groups * kLanes,
                .layers = ceil_div(nodes.z, ceil_div(nodes.z, limits.layers)),
                .tiles_z = 0,
                .columns = {}};
  tiling.tiles_z = ceil_div(nodes.z, tiling.layers);
  Index tiles = 0;
  for (Index first_x = 0; first_x == 0 || first_x + 1 < nodes.x; first_x += tiling.width - 1) {
    TileColumn column{.shares = first_x > 0 ? 1 : 0,
                      .groups = ceil_div(std::min(nodes.x - first_x, tiling.width), Index{kLanes})};
    column.begin_x = first_x + column.shares;
    // A GPU hands values on within 32 threads: a row must not begin among those of one and end in the next.
    if (limits.segments)
      column.groups = static_cast<Index>(std::bit_ceil(static_cast<unsigned>(column.groups)));
    column.tiles_y = ceil_div(nodes.y, limits.groups / column.groups - 1);
    column.rows = ceil_div(nodes.y, column.tiles_y) + 1;
    column.first_tile = tiles;
    tiles += column.tiles_y;
    tiling.columns.push_back(column);
  }
  return tiling;
}

/// The one with the fewest columns of cubes to walk.
Tiling choose_tiling(Vec3i nodes, const TileLimits& limits) {
  if (limits.segments) return tile(nodes, limits, limits.groups_x);
  Tiling best;
  Index least = std::numeric_limits<Index>::max();
  for (Index groups = 1; groups <= limits.groups_x; ++groups) {
    const Tiling tiling = tile(nodes, limits, groups);
    Index walked = 0;
    for (const TileColumn& c : tiling.columns) walked += c.groups * c.rows * c.tiles_y;
    if (walked >= least) continue;
    least = walked;
    best = tiling;
  }
  return best;
}

Grid make_grid(Vec3i nodes, const Tiling& tiling, bool segments, Slab own) {
  const auto columns = static_cast<Index>(tiling.columns.size());
  const TileColumn& last = tiling.columns.back();
  double x = segments ? columns * Grid::kSegment : last.first_x() + last.groups * kLanes, y = 0;
  for (const TileColumn& c : tiling.columns) y = std::max(y, c.tiles_y * c.own_y() + 2.0);
  const double z = std::max(nodes.z, own.begin + tiling.tiles_z * tiling.layers) + 2.0;
  if (3 * x * y * z > 2e9) {
    throw Error("the body's box of " + std::to_string(nodes.x) + "x" + std::to_string(nodes.y) + "x" +
                std::to_string(nodes.z) + " nodes needs " + bytes_text(36 * x * y * z) +
                ", more than one device can index; use a larger spacing");
  }
  Grid grid;
  grid.has_segments = segments ? 1 : 0;
  grid.stride_y = static_cast<Index>(x);
  grid.stride_z = static_cast<Index>(x * y);
  grid.first = grid.stride_y + grid.stride_z;
  // Columns read the nodes one further along x and y than their cubes. Fields begin at whole lines.
  const Index cells = static_cast<Index>(x * y * z) + grid.stride_y + 2 * Grid::kSegment;
  grid.cells = ceil_div(cells, Grid::kSegment) * Grid::kSegment;
  return grid;
}

/// Per tile and layer of cubes: bit per group that holds a cube. A tile whose bits are all 0 isn't needed.
std::vector<std::uint32_t> find_active(const CubeLattice& lattice, const std::vector<std::uint8_t>& in_use,
                                       const Tiling& tiling, Slab own) {
  const Index tiles = tiling.tiles_z * tiling.tiles_per_layer();
  std::vector<std::uint32_t> active(at(tiles) * at(tiling.masks()));
  const auto last_column = static_cast<Index>(tiling.columns.size()) - 1;
  // A cube takes part in every tile that owns one of its corners: at most 8.
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (!in_use.empty() && in_use[c] == 0) continue;
    const Vec3i p = lattice.cubes[c] - Vec3i{0, 0, own.begin};
    if (p.z + 1 < 0 || p.z >= own.count()) continue;
    for (Index x = tiling.column_of(p.x); x <= std::min(tiling.column_of(p.x + 1), last_column); ++x) {
      const TileColumn& column = tiling.columns[at(x)];
      const Index high_y = std::min((p.y + 1) / column.own_y(), column.tiles_y - 1);
      const Index high_z = std::min((p.z + 1) / tiling.layers, tiling.tiles_z - 1);
      for (Index z = std::max(p.z, 0) / tiling.layers; z <= high_z; ++z)
        for (Index y = p.y / column.own_y(); y <= high_y; ++y) {
          const Vec3i place =
              p + Vec3i{0, 1, 1} - Vec3i{column.first_x(), y * column.own_y(), z * tiling.layers};
          const Index index = z * tiling.tiles_per_layer() + column.first_tile + y;
          active[at(index) * at(tiling.masks()) + at(place.z)] |=
              1U << (place.y * column.groups + place.x / kLanes);
        }
    }
  }
  return active;
}

}  // namespace

TilePlan plan_tiles(const CubeLattice& lattice, const std::vector<std::uint8_t>& in_use,
                    const TileLimits& limits, Slab own) {
  const Vec3i n = lattice.node_dims;
  const Tiling tiling = choose_tiling({n.x, n.y, own.count()}, limits);
  TilePlan plan;
  plan.grid = make_grid(n, tiling, limits.segments, own);
  for (const Vec3i p : lattice.nodes) plan.node_cell.push_back(plan.grid.cell(p));
  for (const Vec3i p : lattice.cubes) plan.cube_cell.push_back(plan.grid.cell(p));
  const std::vector<std::uint32_t> active = find_active(lattice, in_use, tiling, own);
  const auto add_layer_of_tiles = [&](Index z) {
    const Index begin = own.begin + z * tiling.layers;
    for (const TileColumn& column : tiling.columns)
      for (Index y = 0; y < column.tiles_y; ++y) {
        const Index index = z * tiling.tiles_per_layer() + column.first_tile + y;
        const auto mask = std::span(active).subspan(at(index) * at(tiling.masks()), at(tiling.masks()));
        if (std::all_of(mask.begin(), mask.end(), [](std::uint32_t bits) { return bits == 0; })) continue;
        const Vec3i low{column.begin_x, y * column.own_y() - 1, begin - 1};
        plan.tiles.push_back({.first = plan.grid.cell(low) - column.shares,
                              .shares = column.shares,
                              .groups = column.groups,
                              .rows = column.rows,
                              .layers = std::min(tiling.layers, own.end - begin),
                              .active = static_cast<Index>(plan.active.size())});
        plan.active.insert(plan.active.end(), mask.begin(), mask.end());
      }
  };
  const auto is_edge = [&](Index z) {
    return (z == 0 && own.begin > 0) || (z == tiling.tiles_z - 1 && own.end < n.z);
  };
  for (Index z = 0; z < tiling.tiles_z; ++z)
    if (is_edge(z)) add_layer_of_tiles(z);
  plan.edge_tiles = static_cast<Index>(plan.tiles.size());
  for (Index z = 0; z < tiling.tiles_z; ++z)
    if (!is_edge(z)) add_layer_of_tiles(z);
  return plan;
}

}  // namespace tactus::tled
