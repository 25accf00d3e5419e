#pragma once
/// Internal forces of a lattice of congruent cubes [P 6]. Sums over a cube's corners, and over the cubes
/// round a node, separate by axis: x, y, z one after the other as lattice columns are walked upwards, so that
/// nothing per element and corner is ever stored.
#include <cstdint>
#include <type_traits>

#include "tactus/compute/kernel.h"
#include "tactus/tissue/tled/cube_forces.h"

namespace tactus::tled {

/// And in three fields, 0 without a cube: lanes of a CPU read neighbouring values best.
struct StiffnessFields {
  View<const float> fields;
  Index cells = 0;
  TACTUS_HD Stiffness operator[](Index cell) const {
    return {fields[cell], fields[cells + cell], fields[2 * cells + cell]};
  }
};

/// A CPU wants tiles as large as its caches allow, a GPU rows that are whole lines of memory, and to read
/// later values while it works on something else: a processor of it has only 24 warps to wait with.
struct TilesOnCpu {
  using Stiffnesses = StiffnessFields;
  static constexpr int kGroups = 32, kGroupsX = 6;
  static constexpr bool kSegments = false, kReadsAhead = false;
};
struct TilesOnGpu {
  using Stiffnesses = StiffnessKinds;
  static constexpr int kGroups = 32, kGroupsX = Grid::kSegment / kLanes;
  static constexpr bool kSegments = true, kReadsAhead = true;
};

/// Internal forces of all nodes [P 6]. One block is a tile; its columns are walked upwards, a layer of cubes
/// at a time, and the forces of each layer on the nodes below and above it are handed on in registers.
template <class Cube, class Tiles, class Sink>
struct ElementForces {
  static constexpr int kThreads = kLanes * Tiles::kGroups, kLeastBlocks = Cube::kLeastBlocks;
  View<const Tile> tiles;
  View<const std::uint32_t> active;
  View<const float> x_m;  ///< 3 fields
  typename Tiles::Stiffnesses stiffness;
  Grid grid;
  Cube cube;
  Sink sink;

  struct Shared {
    Index cell[Tiles::kGroups];        ///< of each group's first column, in the lowest layer
    Index starts_row[Tiles::kGroups];  ///< 1: its first column has none to the left in this tile
    Index shares[Tiles::kGroups];      ///< 1: its first column belongs to the tile before
    /// Per node: force of the row of columns before it, for odd and even layers: while one is read, the next
    /// is written.
    float from_before[2][3][kThreads];
    typename Sink::StepParameters now;
    Index column[kThreads];                 ///< cell of each column in the lowest layer, on a GPU
    std::uint32_t active[kMostLayers + 1];  ///< the tile's masks
  };

  template <class Block>
  struct Column {
    template <class T>
    using PerThread = typename Block::template PerThread<T>;
    PerThread<float> below[4][3];  ///< the layer of nodes below: sums with signs 1, x, y, xy
    PerThread<float> up[4][3];     ///< force of the cube below on the layer above it
    /// Force on the layer between, both cubes': on the nodes to the left and to the right, with signs 1, y.
    PerThread<float> on_left[2][3], on_right[2][3];
    PerThread<Index> kind;  ///< of the next cube, where looked up
  };

  TACTUS_HD void load() requires LoadingKernel<Cube> { cube.load(); }

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Tile tile = tiles[b.index()];
    const int groups = tile.groups * tile.rows;
    Column<Block> column;
    b.for_own(tile.layers + 1, [&](int z) { s.active[z] = active[tile.active + z]; });
    b.for_threads(groups, [&](int g) {
      s.cell[g] = tile.first + g / tile.groups * grid.stride_y + g % tile.groups * kLanes;
      s.starts_row[g] = g % tile.groups == 0 ? 1 : 0;
      s.shares[g] = g % tile.groups == 0 ? tile.shares : 0;
    });
    b.for_own(1, [&](int) { s.now = sink.moment(); });
    b.template for_own_groups<kLanes>(
        groups, [](int) { return true; },
        [&](int g, int t) {
          const Index cell = s.cell[g] + t - (Tiles::kSegments && t == 0 ? s.shares[g] : 0);
          if constexpr (Tiles::kReadsAhead) s.column[g * kLanes + t] = cell;
          float layer[4][3];
          load_layer(cell, layer);
          look_ahead(column, cell, g * kLanes + t);
          for (int m = 0; m < 4; ++m) {
            for (int a = 0; a < 3; ++a) column.below[m][a][g * kLanes + t] = layer[m][a];
            for (int a = 0; a < 3; ++a) column.up[m][a][g * kLanes + t] = 0;
          }
        });
    for (Index z = 0; z <= tile.layers; ++z) {
      const std::uint32_t mask = s.active[z];
      b.template for_own_groups<kLanes>(
          groups, [mask](int g) { return (mask >> g & 1U) != 0; },
          [&](int g, int t) TACTUS_ALWAYS_INLINE {
            cross_cube(column, column_cell(s, g, t) + z * grid.stride_z, g * kLanes + t);
          });
      b.template for_own_groups<kLanes>(
          groups, [mask](int g) { return (mask >> g & 1U) == 0; },
          [&](int g, int t) {
            cross_void(column, column_cell(s, g, t) + z * grid.stride_z, g * kLanes + t);
          });
      if (z > 0) sum_nodes(b, column, s, tile, z);
    }
    b.barrier();
  }

 private:
  TACTUS_HD static Index column_cell(const Shared& s, int g, int t) {
    if constexpr (Tiles::kReadsAhead)
      return s.column[g * kLanes + t];
    else
      return s.cell[g] + t;
  }

  TACTUS_HD void load_layer(Index cell, float (&layer)[4][3]) const {
    const Index right = Tiles::kSegments ? grid.right_of(cell) - cell : 1;
    for (Index a = 0; a < 3; ++a) {
      const Index c = a * grid.cells + cell;
      const float x00 = x_m.constant(c), x10 = x_m.constant(c + right), x01 = x_m.constant(c + grid.stride_y),
                  x11 = x_m.constant(c + grid.stride_y + right);
      const float s0 = x00 + x10, d0 = x10 - x00, s1 = x01 + x11, d1 = x11 - x01;
      layer[0][a] = s0 + s1;
      layer[1][a] = d0 + d1;
      layer[2][a] = s1 - s0;
      layer[3][a] = d1 - d0;
    }
  }

  /// Where a stiffness is found through its kind, that was read while the layer below was worked on.
  template <class C>
  TACTUS_HD Stiffness stiffness_of(C& column, Index cell, int i) const {
    if constexpr (Tiles::kReadsAhead) {
      const Index kind = column.kind[i];
      look_ahead(column, cell + grid.stride_z, i);
      return stiffness.kinds[kind];
    } else {
      return stiffness[cell];
    }
  }
  template <class C>
  TACTUS_HD void look_ahead([[maybe_unused]] C& column, [[maybe_unused]] Index cell,
                            [[maybe_unused]] int i) const {
    if constexpr (Tiles::kReadsAhead) column.kind[i] = stiffness.kind.constant(cell);
  }

  /// Always inlined, as the cubes' forces are (cube_forces.h).
  template <class C>
  TACTUS_HD TACTUS_ALWAYS_INLINE void cross_cube(C& column, Index cell, int i) const {
    const Stiffness k = stiffness_of(column, cell, i);
    float above[4][3];
    load_layer(cell + grid.stride_z, above);
    const auto sum = [&](int m) {
      return Vec3f{column.below[m][0][i] + above[m][0], column.below[m][1][i] + above[m][1],
                   column.below[m][2][i] + above[m][2]};
    };
    const auto difference = [&](int m) {
      return Vec3f{above[m][0] - column.below[m][0][i], above[m][1] - column.below[m][1][i],
                   above[m][2] - column.below[m][2][i]};
    };
    const CubeModes u{sum(1), sum(2), difference(0), sum(3), difference(2), difference(1), difference(3)};
    const CubeModes f = cube.force(u, k, cell);
    hand_on(column, 0, i, -f.z, f.z, f.x - f.xz, f.x + f.xz);
    hand_on(column, 1, i, f.y - f.yz, f.y + f.yz, f.xy - f.xyz, f.xy + f.xyz);
    for (int m = 0; m < 4; ++m) {
      for (int a = 0; a < 3; ++a) column.below[m][a][i] = above[m][a];
    }
  }

  /// Where there is no cube, only the force of the cube below is handed on.
  template <class C>
  TACTUS_HD void cross_void(C& column, Index cell, int i) const {
    float above[4][3];
    load_layer(cell + grid.stride_z, above);
    look_ahead(column, cell + grid.stride_z, i);
    hand_on(column, 0, i, {}, {}, {}, {});
    hand_on(column, 1, i, {}, {}, {}, {});
    for (int m = 0; m < 4; ++m) {
      for (int a = 0; a < 3; ++a) column.below[m][a][i] = above[m][a];
    }
  }

  /// Values of a node that the sink reads: before its force is known, or then.
  struct NodeAhead {
    typename Sink::Node kept;
    TACTUS_HD void read_ahead(const Sink& to, Index cell) { kept = to.read(cell); }
    TACTUS_HD const typename Sink::Node& read(const Sink&, Index) const { return kept; }
  };
  struct NodeThen {
    TACTUS_HD void read_ahead(const Sink&, Index) {}
    TACTUS_HD typename Sink::Node read(const Sink& to, Index cell) const { return to.read(cell); }
  };

  /// Hands on a cube's forces on its lower and upper nodes: the sums with signs 1, x if y is 0, with y, xy if
  /// it is 1.
  template <class C>
  TACTUS_HD void hand_on(C& column, int y, int i, Vec3f down, Vec3f up, Vec3f down_x, Vec3f up_x) const {
    const Vec3f both = Vec3f{column.up[2 * y][0][i], column.up[2 * y][1][i], column.up[2 * y][2][i]} + down;
    const Vec3f both_x =
        Vec3f{column.up[2 * y + 1][0][i], column.up[2 * y + 1][1][i], column.up[2 * y + 1][2][i]} + down_x;
    put(column.on_left[y], i, both - both_x);
    put(column.on_right[y], i, both + both_x);
    put(column.up[2 * y], i, up);
    put(column.up[2 * y + 1], i, up_x);
  }
  template <class T>
  TACTUS_HD static void put(T (&fields)[3], int i, Vec3f value) {
    fields[0][i] = value.x;
    fields[1][i] = value.y;
    fields[2][i] = value.z;
  }

  /// Forces on the own nodes of a layer: first from the columns left and right of each, then from the rows of
  /// columns before and behind.
  template <class Block, class C>
  TACTUS_HD void sum_nodes(const Block& b, const C& column, Shared& s, const Tile& tile, Index z) const {
    auto& from_before = s.from_before[z & 1];
    const int row = tile.groups * kLanes, groups = tile.groups * tile.rows;
    typename Block::template PerThread<float> f[3];
    typename Block::template PerThread<std::conditional_t<Tiles::kReadsAhead, NodeAhead, NodeThen>> node;
    b.template for_own_groups<kLanes>(
        groups, [&](int g) { return g >= tile.groups; },
        [&](int g, int t) {
          node[g * kLanes + t].read_ahead(sink, column_cell(s, g, t) + z * grid.stride_z);
        });
    decltype(b.previous(column.on_right[0][0])) left[2][3];
    for (int y = 0; y < 2; ++y)
      for (int a = 0; a < 3; ++a) left[y][a] = b.previous(column.on_right[y][a]);
    b.template for_own_groups<kLanes>(
        groups, [](int) { return true; },
        [&](int g, int t) {
          const int i = g * kLanes + t;
          const bool has_left = !Tiles::kSegments || t > 0 || s.starts_row[g] == 0;
          for (int a = 0; a < 3; ++a) {
            const float one = (has_left ? left[0][a][i] : 0.F) + column.on_left[0][a][i],
                        y = (has_left ? left[1][a][i] : 0.F) + column.on_left[1][a][i];
            from_before[a][i] = one + y;
            f[a][i] = one - y;
          }
        });
    b.barrier();
    b.template for_own_groups<kLanes>(
        groups, [&](int g) { return g >= tile.groups; },
        [&](int g, int t) {
          const int i = g * kLanes + t, before = max(i - row, 0);
          for (int a = 0; a < 3; ++a) f[a][i] += from_before[a][before];
        });
    const typename Sink::StepParameters now = s.now;
    b.template for_own_groups<kLanes>(
        groups, [&](int g) { return g >= tile.groups; },
        [&](int g, int t) {
          const int i = g * kLanes + t;
          const Index cell = column_cell(s, g, t) + z * grid.stride_z;
          if (t > 0 || s.shares[g] == 0)
            sink(cell, {f[0][i], f[1][i], f[2][i]}, node[i].read(sink, cell), now);
        });
  }
};

}  // namespace tactus::tled
