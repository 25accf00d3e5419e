#pragma once
/// Internal forces of a lattice of congruent cubes [P 6]. Sums over a cube's corners, and over the cubes
/// round a node, separate by axis: x, y, z one after the other as lattice columns are walked upwards, so that
/// nothing per element and corner is ever stored.
#include <cstdint>

#include "tactus/compute/kernel.h"
#include "tactus/tissue/tled/cube_forces.h"

namespace tactus::tled {

/// Cells of a dense box round the lattice: node (i,j,k) and the cube above it share cell
/// first + i + j stride_y + k stride_z. Cubes that don't exist have stiffness 0.
struct Grid {
  Index stride_y = 0, stride_z = 0, first = 0, cells = 0;
  TACTUS_HD Index cell(Vec3i p) const { return first + p.x + p.y * stride_y + p.z * stride_z; }
};

/// Columns of cubes that one block walks: `groups` of 8 along x times `rows` along y, `layers` of nodes up.
/// Own nodes are those between columns: neighbouring tiles share a row and a column of cubes.
struct Tile {
  Index first = 0;  ///< cell below, before and left of the first own node
  Index groups = 0, rows = 0, layers = 0;
  Index active = 0;  ///< into the masks: one per layer of cubes, bit per group that holds a cube
};

/// A CPU wants tiles as wide as its caches allow, a GPU many small ones, and what they need on its way early.
struct TilesOnCpu {
  static constexpr int kGroups = 32;
  static constexpr bool kFetches = false;
};
struct TilesOnGpu {
  static constexpr int kGroups = 16;
  static constexpr bool kFetches = true;
};

/// Internal forces of all nodes [P 6]. One block is a tile; its columns are walked upwards, a layer of cubes
/// at a time, and what each layer exerts on the nodes below and above it is handed on in registers.
template <class Cube, class Tiles, class Sink>
struct ElementForces {
  static constexpr int kMaxGroups = Tiles::kGroups;
  static constexpr int kLanes = 8, kThreads = kLanes * kMaxGroups;
  /// Layers of nodes that are on their way from memory while one is worked on, and that one.
  static constexpr int kLayers = 3;
  /// Nodes under a tile's columns, of any shape with at most 4 groups along x.
  static constexpr int kNodes = kThreads + kMaxGroups + 4 * kLanes + 1;
  View<const Tile> tiles;
  View<const std::uint32_t> active;
  View<const float> x_m;        ///< 3 fields
  View<const float> stiffness;  ///< per cube: mu, lambda [Pa], hourglass k [N/m]; 3 fields
  Grid grid;
  Cube cube;
  Sink sink;

  struct Shared {
    int row_of[kMaxGroups];        ///< which row of columns a group is in
    Index cell[kMaxGroups];        ///< of each group's first column, in the lowest layer
    Index starts_row[kMaxGroups];  ///< 1: its first column belongs to the tile before
    /// Per node and row of columns: force with signs 1, y. Of odd and even layers: while one is read, the
    /// next is written.
    float row[2][2][3][kThreads];
    /// Where blocks fetch ahead: corners above the cubes of a layer, and what only their own thread reads.
    struct Layer {
      float x_m[3][kNodes];
      float stiffness[3][kThreads];
      float sink[Sink::kInputs + 1][kThreads];
    } layer[Tiles::kFetches ? kLayers : 1];
  };

  template <class Block>
  struct Column {
    template <class T>
    using PerThread = typename Block::template PerThread<T>;
    PerThread<float> below[4][3];  ///< the layer of nodes below: sums with signs 1, x, y, xy
    PerThread<float> up[4][3];     ///< force of the cube below on the layer above it
    PerThread<float> on[4][3];     ///< force on the layer between, both cubes': sums with the same signs
  };

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Tile tile = tiles[b.index()];
    const int groups = tile.groups * tile.rows;
    Column<Block> column;
    b.for_threads(groups, [&](int g) {
      s.row_of[g] = g / tile.groups;
      s.cell[g] = tile.first + s.row_of[g] * grid.stride_y + g % tile.groups * kLanes;
      s.starts_row[g] = g % tile.groups == 0 ? 1 : 0;
    });
    for (Index z = -1; z < kLayers - 1; ++z) fetch(b, s, tile, z);
    await_next_layer(b);
    b.template for_own_groups<kLanes>(
        groups, [](int) { return true; },
        [&](int g, int t) {
          float layer[4][3];
          load_layer(corners<Block>(s, tile, -1, g, t), layer);
          for (int m = 0; m < 4; ++m) {
            for (int a = 0; a < 3; ++a) column.below[m][a][g * kLanes + t] = layer[m][a];
            for (int a = 0; a < 3; ++a) column.up[m][a][g * kLanes + t] = 0;
          }
        });
    b.barrier();
    for (Index z = 0; z <= tile.layers; ++z) {
      fetch(b, s, tile, z + kLayers - 1);
      const std::uint32_t mask = active[tile.active + z];
      b.template for_own_groups<kLanes>(
          groups, [mask](int g) { return (mask >> g & 1U) != 0; },
          [&](int g, int t) { cross_cube<Block>(column, s, tile, z, g, t); });
      b.template for_own_groups<kLanes>(
          groups, [mask](int g) { return (mask >> g & 1U) == 0; },
          [&](int g, int t) { cross_void<Block>(column, s, tile, z, g, t); });
      if (z > 0) sum_columns(b, column, s, tile, z);
      await_next_layer(b);
      if (z > 0) sum_rows(b, s, tile, z);
    }
    b.barrier();
  }

 private:
  /// Corners of one column between two cubes.
  struct Corners {
    View<const float> x_m;
    Index at, stride_y, field;
  };

  static constexpr int slot(Index z) { return static_cast<int>((z + kLayers) % kLayers); }

  /// Starts to bring what layer z needs: the nodes above its cubes, their stiffness, what its nodes bring
  /// along. All threads call it, layer by layer.
  template <class Block>
  TACTUS_HD void fetch(const Block& b, Shared& s, const Tile& tile, Index z) const {
    if constexpr (Tiles::kFetches) {
      typename Shared::Layer& to = s.layer[slot(z)];
      const int pitch = tile.groups * kLanes + 1, nodes = pitch * (tile.rows + 1);
      b.for_own(kThreads, [&](int i) {
        const int g = i / kLanes, t = i % kLanes;
        for (int n = i; n < nodes && z <= tile.layers; n += kThreads) {
          const Index from = tile.first + n / pitch * grid.stride_y + n % pitch + (z + 1) * grid.stride_z;
          for (int a = 0; a < 3; ++a) b.fetch(to.x_m[a][n], x_m[a * grid.cells + from]);
        }
        if (z >= 0 && z <= tile.layers && g < tile.groups * tile.rows) {
          const Index cell = s.cell[g] + t + z * grid.stride_z;
          for (int a = 0; a < 3; ++a) b.fetch(to.stiffness[a][i], stiffness[a * grid.cells + cell]);
          if constexpr (Sink::kInputs > 0) {
            for (int n = 0; n < Sink::kInputs && is_own(s, tile, g, t); ++n)
              b.fetch(to.sink[n][i], sink.input(n, cell));
          }
        }
        b.end_fetches();
      });
    }
  }

  /// What layer z + 1 needs is there, whoever fetched it.
  template <class Block>
  TACTUS_HD void await_next_layer(const Block& b) const {
    if constexpr (Tiles::kFetches) b.template await_fetches<kLayers - 2>();
    b.barrier();
  }

  TACTUS_HD static bool is_own(const Shared& s, const Tile& tile, int g, int t) {
    return g >= tile.groups && (t > 0 || s.starts_row[g] == 0);
  }

  template <class Block>
  TACTUS_HD Corners corners(const Shared& s, const Tile& tile, Index z, int g, int t) const {
    if constexpr (Tiles::kFetches) {
      return {View<const float>(s.layer[slot(z)].x_m[0], 3 * kNodes), g * kLanes + t + s.row_of[g],
              tile.groups * kLanes + 1, kNodes};
    } else {
      return {x_m, s.cell[g] + t + (z + 1) * grid.stride_z, grid.stride_y, grid.cells};
    }
  }

  TACTUS_HD void load_layer(const Corners& c, float (&layer)[4][3]) const {
    for (Index a = 0; a < 3; ++a) {
      const Index i = a * c.field + c.at;
      const float x00 = c.x_m[i], x10 = c.x_m[i + 1], x01 = c.x_m[i + c.stride_y],
                  x11 = c.x_m[i + c.stride_y + 1];
      const float s0 = x00 + x10, d0 = x10 - x00, s1 = x01 + x11, d1 = x11 - x01;
      layer[0][a] = s0 + s1;
      layer[1][a] = d0 + d1;
      layer[2][a] = s1 - s0;
      layer[3][a] = d1 - d0;
    }
  }

  template <class Block>
  TACTUS_HD void cross_cube(Column<Block>& column, const Shared& s, const Tile& tile, Index z, int g,
                            int t) const {
    const int i = g * kLanes + t;
    const Index cell = s.cell[g] + t + z * grid.stride_z;
    float above[4][3];
    load_layer(corners<Block>(s, tile, z, g, t), above);
    const auto sum = [&](int m) {
      return Vec3f{column.below[m][0][i] + above[m][0], column.below[m][1][i] + above[m][1],
                   column.below[m][2][i] + above[m][2]};
    };
    const auto difference = [&](int m) {
      return Vec3f{above[m][0] - column.below[m][0][i], above[m][1] - column.below[m][1][i],
                   above[m][2] - column.below[m][2][i]};
    };
    const CubeModes u{sum(1), sum(2), difference(0), sum(3), difference(2), difference(1), difference(3)};
    const auto k = [&](int a) {
      if constexpr (Tiles::kFetches)
        return s.layer[slot(z)].stiffness[a][i];
      else
        return stiffness[a * grid.cells + cell];
    };
    const CubeModes f = cube.force(u, k(0), k(1), k(2), cell);
    hand_on(column, 0, i, Vec3f{}, f.z);
    hand_on(column, 1, i, f.x, f.xz);
    hand_on(column, 2, i, f.y, f.yz);
    hand_on(column, 3, i, f.xy, f.xyz);
    for (int m = 0; m < 4; ++m) {
      for (int a = 0; a < 3; ++a) column.below[m][a][i] = above[m][a];
    }
  }

  /// Where there is no cube, only what the one below exerts is handed on.
  template <class Block>
  TACTUS_HD void cross_void(Column<Block>& column, const Shared& s, const Tile& tile, Index z, int g,
                            int t) const {
    const int i = g * kLanes + t;
    float above[4][3];
    load_layer(corners<Block>(s, tile, z, g, t), above);
    for (int m = 0; m < 4; ++m) {
      hand_on(column, m, i, Vec3f{}, Vec3f{});
      for (int a = 0; a < 3; ++a) column.below[m][a][i] = above[m][a];
    }
  }

  /// `even` and `odd`: modes without and with the sign of z.
  template <class C>
  TACTUS_HD void hand_on(C& column, int m, int i, Vec3f even, Vec3f odd) const {
    const Vec3f down = even - odd, up = even + odd;
    column.on[m][0][i] = column.up[m][0][i] + down.x;
    column.on[m][1][i] = column.up[m][1][i] + down.y;
    column.on[m][2][i] = column.up[m][2][i] + down.z;
    column.up[m][0][i] = up.x;
    column.up[m][1][i] = up.y;
    column.up[m][2][i] = up.z;
  }

  /// Forces on the nodes of a layer: first from the columns left and right of each.
  template <class Block>
  TACTUS_HD void sum_columns(const Block& b, const Column<Block>& column, Shared& s, const Tile& tile,
                             Index z) const {
    decltype(b.previous(column.on[0][0])) left[4][3];
    for (int m = 0; m < 4; ++m)
      for (int a = 0; a < 3; ++a) left[m][a] = b.previous(column.on[m][a]);
    b.template for_own_groups<kLanes>(
        tile.groups * tile.rows, [](int) { return true; },
        [&](int g, int t) {
          const int i = g * kLanes + t;
          for (int y = 0; y < 2; ++y)
            for (int a = 0; a < 3; ++a) {
              const auto &even = column.on[2 * y][a], &odd = column.on[2 * y + 1][a];
              s.row[z & 1][y][a][i] = (left[2 * y][a][i] + left[2 * y + 1][a][i]) + (even[i] - odd[i]);
            }
        });
  }

  /// Then, on own nodes, from the rows of columns before and behind.
  template <class Block>
  TACTUS_HD void sum_rows(const Block& b, const Shared& s, const Tile& tile, Index z) const {
    const auto& rows = s.row[z & 1];
    const int row = tile.groups * kLanes, groups = tile.groups * tile.rows;
    typename Block::template PerThread<float> f[3];
    b.template for_own_groups<kLanes>(
        groups, [&](int g) { return g >= tile.groups; },
        [&](int g, int t) {
          const int i = g * kLanes + t, before = max(i - row, 0);
          for (int a = 0; a < 3; ++a) {
            f[a][i] = (rows[0][a][before] + rows[1][a][before]) + (rows[0][a][i] - rows[1][a][i]);
          }
        });
    b.template for_own_groups<kLanes>(
        groups, [&](int g) { return g >= tile.groups; },
        [&](int g, int t) {
          if (!is_own(s, tile, g, t)) return;
          const int i = g * kLanes + t;
          const Index cell = s.cell[g] + t + z * grid.stride_z;
          const Vec3f sum{f[0][i], f[1][i], f[2][i]};
          if constexpr (Sink::kInputs == 0)
            sink(cell, sum);
          else if constexpr (Tiles::kFetches)
            sink(cell, sum, [&](int n) { return s.layer[slot(z)].sink[n][i]; });
          else
            sink(cell, sum, [&](int n) { return sink.input(n, cell); });
        });
  }
};

}  // namespace tactus::tled
