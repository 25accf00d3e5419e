#include "tactus/tissue/tled/tile_plan.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <span>
#include <string>

#include "tactus/base/at.h"
#include "tactus/base/error.h"

namespace tactus::tled {
namespace {

/// Tiles with the same nodes along x: those of one segment of rows. Where fewer nodes are left, there is
/// capacity for more rows.
struct TileColumn {
  Index begin_x = 0;  ///< first own node
  Index shares = 0;   ///< Tile's
  Index groups = 0, rows = 0;
  Index tiles_y = 0;
  Index first_tile = 0;  ///< of all tiles of a layer
  Index own_y() const { return rows - 1; }
  Index first_x() const { return begin_x - shares; }
};

/// The columns of a layer of tiles.
struct Tiling {
  Index width = 0;    ///< columns of cubes per tile along x, but for the last; neighbours share one
  Index first_x = 0;  ///< of the first column of cubes
  std::vector<TileColumn> columns;
  Index tiles_per_layer() const { return columns.back().first_tile + columns.back().tiles_y; }
  Index column_of(Index node_x) const { return (node_x - first_x - 1) / (width - 1); }
};

/// @param nodes own ones along each axis
Tiling tile(Vec3i nodes, const TileLimits& limits, Index groups) {
  // The empty column before the first cubes costs a GPU half a row of threads where a segment ends with it; a
  // CPU walks it rather than asking in every row whether there is one to the left.
  Tiling tiling{.width = groups * kLanes, .first_x = limits.segments ? 0 : -1, .columns = {}};
  Index tiles = 0, first_x = tiling.first_x;
  for (; tiles == 0 || first_x + 1 < nodes.x; first_x += tiling.width - 1) {
    TileColumn column{.shares = first_x == 0 ? 0 : 1,
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

/// Which groups of a tile hold a cube: a bit each, per layer of cubes round the own nodes and tile of a
/// layer.
class Masks {
 public:
  Masks(const CubeLattice& lattice, const std::vector<std::uint8_t>& in_use, const Tiling& tiling, Slab own)
      : tiles_(tiling.tiles_per_layer()), of_(at(own.count() + 1) * at(tiles_)) {
    const auto last_column = static_cast<Index>(tiling.columns.size()) - 1;
    // A cube takes part in every tile that owns one of its corners: at most 4 in its layer.
    for (std::size_t c = 0; c < at(lattice.regular_cubes()); ++c) {
      if (!in_use.empty() && in_use[c] == 0) continue;
      const Vec3i p = lattice.cubes[c];
      const Index layer = p.z + 1 - own.begin;
      if (layer < 0 || layer > own.count()) continue;
      for (Index x = tiling.column_of(p.x); x <= std::min(tiling.column_of(p.x + 1), last_column); ++x) {
        const TileColumn& column = tiling.columns[at(x)];
        const Index high_y = std::min((p.y + 1) / column.own_y(), column.tiles_y - 1);
        for (Index y = p.y / column.own_y(); y <= high_y; ++y) {
          const Index row = p.y + 1 - y * column.own_y(), group = (p.x - column.first_x()) / kLanes;
          of_[at(layer * tiles_ + column.first_tile + y)] |= 1U << (row * column.groups + group);
        }
      }
    }
  }
  /// @param layer of cubes, 0 below the first own nodes
  std::uint32_t operator()(Index layer, Index tile) const { return of_[at(layer * tiles_ + tile)]; }
  /// Whether a tile over so many layers of nodes from `begin` has a cube.
  bool any(Index tile, Index begin, Index layers) const {
    for (Index z = begin; z <= begin + layers; ++z)
      if ((*this)(z, tile) != 0) return true;
    return false;
  }

 private:
  Index tiles_;
  std::vector<std::uint32_t> of_;
};

/// Layers of nodes per tile.
struct Height {
  Index nodes = 0, layers = 0;
  Height(Index nodes_z, Index at_most) : nodes(nodes_z), layers(ceil_div(nodes, ceil_div(nodes, at_most))) {}
  Index tiles() const { return ceil_div(nodes, layers); }
  Index begin(Index z) const { return z * layers; }
  Index count(Index z) const { return std::min(layers, nodes - begin(z)); }
};

/// A tile loads one layer more than it walks, and walks one more than it owns: tall ones share most. But a
/// processor works on `resident` blocks at once, in little more time than on one of them, and all wait for
/// the one that has most. The steps of b blocks at a time took 1.5, 1.9 and 2.4 us on an H200 for b = 1, 2
/// and 3: fitted to `tactus bench tissue` of 16^3 to 100^3 cubes with `layers` 1 to 32 and `processors` 0.
Height choose_height(const Masks& masks, Index tiles_per_layer, Index nodes_z, const TileLimits& limits) {
  Height best(nodes_z, limits.layers);
  if (limits.processors == 0) return best;
  constexpr double kBlockAlone = 1.1, kPerBlock = 0.4;
  constexpr Index kResident = 3;
  double least = std::numeric_limits<double>::max();
  for (Index at_most = limits.layers; at_most >= 1; --at_most) {
    const Height height(nodes_z, at_most);
    Index tiles = 0;
    for (Index z = 0; z < height.tiles(); ++z)
      for (Index t = 0; t < tiles_per_layer; ++t)
        tiles += masks.any(t, height.begin(z), height.count(z)) ? 1 : 0;
    const Index blocks = std::max(ceil_div(tiles, limits.processors), Index{1});
    const double rounds = std::max(1.0, static_cast<double>(blocks) / kResident);
    const double cost =
        (height.layers + 2) * rounds * (kBlockAlone + kPerBlock * std::min(blocks, kResident));
    if (cost >= least) continue;
    least = cost;
    best = height;
  }
  return best;
}

Grid make_grid(Vec3i nodes, const Tiling& tiling, const Height& height, bool segments, Slab own) {
  const auto columns = static_cast<Index>(tiling.columns.size());
  const TileColumn& last = tiling.columns.back();
  double x = segments ? columns * Grid::kSegment : last.first_x() + last.groups * kLanes + 1, y = 0;
  for (const TileColumn& c : tiling.columns) y = std::max(y, c.tiles_y * c.own_y() + 2.0);
  const double z = std::max(nodes.z, own.begin + height.tiles() * height.layers) + 2.0;
  if (3 * x * y * z > 2e9) {
    throw Error("the body's box of " + std::to_string(nodes.x) + "x" + std::to_string(nodes.y) + "x" +
                std::to_string(nodes.z) + " nodes needs " + bytes_text(36 * x * y * z) +
                ", more than one device can index; use a larger spacing");
  }
  Grid grid;
  grid.has_segments = segments ? 1 : 0;
  grid.stride_y = static_cast<Index>(x);
  grid.stride_z = static_cast<Index>(x * y);
  grid.first = grid.stride_y + grid.stride_z - tiling.first_x;
  // Columns read the nodes one further along x and y than their cubes. Fields begin at whole lines.
  const Index cells = static_cast<Index>(x * y * z) + grid.stride_y + 2 * Grid::kSegment;
  grid.cells = ceil_div(cells, Grid::kSegment) * Grid::kSegment;
  return grid;
}

}  // namespace

TilePlan plan_tiles(const CubeLattice& lattice, const std::vector<std::uint8_t>& in_use,
                    const TileLimits& limits, Slab own) {
  const Vec3i n = lattice.node_dims;
  const Tiling tiling = choose_tiling({n.x, n.y, own.count()}, limits);
  const Masks masks(lattice, in_use, tiling, own);
  const Height height = choose_height(masks, tiling.tiles_per_layer(), own.count(), limits);
  TilePlan plan;
  plan.grid = make_grid(n, tiling, height, limits.segments, own);
  for (Index i = 0; i < lattice.regular_nodes(); ++i)
    plan.node_cell.push_back(plan.grid.cell(lattice.nodes[at(i)]));
  for (Index c = 0; c < lattice.regular_cubes(); ++c)
    plan.cube_cell.push_back(plan.grid.cell(lattice.cubes[at(c)]));
  plan.first_virtual_cell = plan.grid.cells;
  for (std::size_t k = 0; k < lattice.virtual_nodes.size(); ++k) plan.node_cell.push_back(plan.grid.cells++);
  plan.grid.cells = ceil_div(plan.grid.cells, Grid::kSegment) * Grid::kSegment;
  const auto add_layer_of_tiles = [&](Index z) {
    const Index begin = height.begin(z), layers = height.count(z);
    for (const TileColumn& column : tiling.columns)
      for (Index y = 0; y < column.tiles_y; ++y) {
        const Index index = column.first_tile + y;
        if (!masks.any(index, begin, layers)) continue;
        const Vec3i low{column.begin_x, y * column.own_y() - 1, own.begin + begin - 1};
        plan.tiles.push_back({.first = plan.grid.cell(low) - column.shares,
                              .shares = column.shares,
                              .groups = column.groups,
                              .rows = column.rows,
                              .layers = layers,
                              .active = static_cast<Index>(plan.active.size())});
        for (Index layer = begin; layer <= begin + layers; ++layer)
          plan.active.push_back(masks(layer, index));
      }
  };
  const Index tiles_z = height.tiles();
  const auto is_edge = [&](Index z) {
    return (z == 0 && own.begin > 0) || (z == tiles_z - 1 && own.end < n.z);
  };
  for (Index z = 0; z < tiles_z; ++z)
    if (is_edge(z)) add_layer_of_tiles(z);
  plan.edge_tiles = static_cast<Index>(plan.tiles.size());
  for (Index z = 0; z < tiles_z; ++z)
    if (!is_edge(z)) add_layer_of_tiles(z);
  return plan;
}

}  // namespace tactus::tled
