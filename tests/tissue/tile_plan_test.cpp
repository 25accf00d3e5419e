// Every node is moved by one tile, which walks all cubes round it: for tiles of CPUs and for those of GPUs,
// whose rows are cut into segments.
#include "tactus/tissue/tled/tile_plan.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

namespace tactus::tled {
namespace {

/// A box with holes at random.
CubeLattice sponge(Vec3i cubes, unsigned seed) {
  CubeLattice lattice = lattice_from_box({0, 0, 0}, cubes, {.spacing_m = 0.01F});
  std::mt19937 random(seed);
  std::vector<std::uint8_t> keep(lattice.cubes.size());
  for (std::uint8_t& k : keep) k = random() % 3 != 0 ? 1 : 0;
  keep[0] = 1;
  CubeLattice kept = lattice;
  kept.cubes.clear();
  for (std::size_t c = 0; c < keep.size(); ++c)
    if (keep[c] != 0) kept.cubes.push_back(lattice.cubes[c]);
  return kept;
}

/// The columns of a tile: where each cube and its lower left node are, and whether that node is its own.
struct Column {
  Index cell = 0, group = 0;
  bool own = false;
};

std::vector<Column> columns_of(const Tile& tile, const Grid& grid) {
  std::vector<Column> columns;
  for (Index y = 0; y < tile.rows; ++y)
    for (Index x = 0; x < tile.groups * kLanes; ++x) {
      const Index gap = x == 0 ? grid.has_segments * tile.shares : 0;
      columns.push_back({tile.first + y * grid.stride_y + x - gap, y * tile.groups + x / kLanes,
                         y > 0 && x >= tile.shares});
    }
  return columns;
}

void expect_each_node_once(const CubeLattice& lattice, const TileLimits& limits, Slab own) {
  const TilePlan plan = plan_tiles(lattice, {}, limits, own);
  std::map<Index, std::vector<Index>> cubes_at;  // per cell of a node: cells of the cubes round it
  std::set<Index> cells;
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    for (Index q = 0; q < 8; ++q) {
      const Vec3i p = lattice.cubes[c] + Vec3i{q & 1, q >> 1 & 1, q >> 2};
      if (p.z >= own.begin && p.z < own.end) cubes_at[plan.grid.cell(p)].push_back(plan.cube_cell[c]);
    }
    EXPECT_EQ(plan.grid.right_of(plan.cube_cell[c]), plan.grid.cell(lattice.cubes[c] + Vec3i{1, 0, 0}));
    cells.insert(plan.cube_cell[c]);
  }
  EXPECT_EQ(cells.size(), lattice.cubes.size());
  std::map<Index, int> moved;
  for (const Tile& tile : plan.tiles) {
    EXPECT_LE(tile.groups * tile.rows, limits.groups);
    std::set<Index> walked;
    for (Index z = 0; z <= tile.layers; ++z)
      for (const Column& column : columns_of(tile, plan.grid)) {
        const Index cell = column.cell + z * plan.grid.stride_z;
        EXPECT_GE(cell, 0);
        EXPECT_LT(plan.grid.right_of(cell) + plan.grid.stride_y + plan.grid.stride_z, plan.grid.cells);
        const std::uint32_t mask = plan.active[static_cast<std::size_t>(tile.active + z)];
        if ((mask >> column.group & 1U) != 0) walked.insert(cell);
      }
    for (Index z = 1; z <= tile.layers; ++z)
      for (const Column& column : columns_of(tile, plan.grid)) {
        const auto node = cubes_at.find(column.cell + z * plan.grid.stride_z);
        if (!column.own || node == cubes_at.end()) continue;
        moved[node->first]++;
        for (const Index cube : node->second) EXPECT_TRUE(walked.contains(cube));
      }
  }
  EXPECT_EQ(moved.size(), cubes_at.size());
  for (const auto& [cell, times] : moved) EXPECT_EQ(times, 1) << "cell " << cell;
}

TEST(TilePlan, EachNodeIsMovedOnceByATileThatWalksItsCubes) {
  // Widths round those of a segment's 32 nodes and of two segments, whose last tiles are narrow.
  for (const Vec3i cubes : {Vec3i{3, 5, 9},
                            {29, 8, 4},
                            {30, 9, 7},
                            {31, 3, 2},
                            {32, 3, 2},
                            {46, 17, 5},
                            {62, 5, 3},
                            {63, 5, 3},
                            {70, 2, 6}}) {
    const CubeLattice lattice = sponge(cubes, 7);
    for (const Index layers : {1, 3, 16}) {
      const TileLimits cpu{.groups = 32, .groups_x = 6, .segments = false, .layers = layers};
      const TileLimits gpu{.groups = 32, .groups_x = 4, .segments = true, .layers = layers};
      TileLimits shared = gpu;
      shared.processors = 20;
      for (const TileLimits& limits : {cpu, gpu, shared}) {
        SCOPED_TRACE(testing::Message()
                     << cubes.x << "x" << cubes.y << "x" << cubes.z << " layers " << layers << " segments "
                     << limits.segments << " processors " << limits.processors);
        expect_each_node_once(lattice, limits, {0, lattice.node_dims.z});
        if (cubes.z > 4) expect_each_node_once(lattice, limits, {2, lattice.node_dims.z - 1});
      }
    }
  }
}

/// Rows of 47 nodes are tiles of 32 and of 15 nodes: 7 and 4 of them, of up to 8 and 16 rows, are 11 for each
/// layer of tiles.
TEST(TilePlan, AsManyLayersAsKeepAllProcessorsBusy) {
  const auto layers_of = [](Index cubes, Index processors) {
    const CubeLattice lattice = lattice_from_box({0, 0, 0}, {cubes, cubes, cubes}, {.spacing_m = 0.01F});
    const TileLimits limits{
        .groups = 32, .groups_x = 4, .segments = true, .layers = 16, .processors = processors};
    return plan_tiles(lattice, {}, limits, {0, lattice.node_dims.z}).tiles.front().layers;
  };
  EXPECT_EQ(layers_of(46, 0), 16);
  EXPECT_EQ(layers_of(46, 132), 2);  // 24 x 11 = 264 tiles: two for each processor
  EXPECT_EQ(layers_of(46, 11), 16);  // 3 x 11: three
  EXPECT_EQ(layers_of(16, 132), 1);
}

/// A GPU's threads hand values on within rows of 32.
TEST(TilePlan, RowsOfSegmentsDivide32Threads) {
  for (Index width = 1; width < 70; ++width) {
    const CubeLattice lattice = lattice_from_box({0, 0, 0}, {width, 3, 3}, {.spacing_m = 0.01F});
    const TilePlan plan = plan_tiles(
        lattice, {}, {.groups = 32, .groups_x = 4, .segments = true, .layers = 4}, {0, lattice.node_dims.z});
    EXPECT_EQ(plan.grid.stride_y % Grid::kSegment, 0);
    EXPECT_EQ(plan.grid.cells % Grid::kSegment, 0);
    for (const Tile& tile : plan.tiles) {
      EXPECT_EQ(32 % (tile.groups * kLanes), 0) << "width " << width;
      EXPECT_EQ(tile.first % Grid::kSegment, 0) << "width " << width;
    }
  }
}

}  // namespace
}  // namespace tactus::tled
