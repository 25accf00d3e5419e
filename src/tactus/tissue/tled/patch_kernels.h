#pragma once
/// Copies of cubes that were cut: their forces, and the nodes on which they act. They stand in lists beside
/// the dense tiles.
#include "tactus/tissue/embed_kernels.h"
#include "tactus/tissue/tled/tled_kernels.h"

namespace tactus::tled {

/// A copy's corners.
struct CopyCells {
  Index cell[8];
};

/// What each copy exerts on its eight corners: the same modes as in ElementForces, summed in the same order.
template <class Cube>
struct CopyForces {
  View<const CopyCells> corners;    ///< per copy
  View<const Stiffness> stiffness;  ///< likewise; 0: no copy
  View<const float> x_m;            ///< 3 fields over cells
  View<Vec3f> f_N;                  ///< out: eight per copy
  Index cells;
  Cube cube;
  TACTUS_HD void load() {
    if constexpr (LoadingKernel<Cube>) cube.load();
  }

  TACTUS_HD void operator()(Index c) const {
    const CopyCells at = corners[c];
    Vec3f layer[2][4];  // of nodes: sums with signs 1, x, y, xy
    for (int z = 0; z < 2; ++z) {
      const Vec3f a = vector_at(x_m, cells, at.cell[4 * z]), b = vector_at(x_m, cells, at.cell[4 * z + 1]);
      const Vec3f d = vector_at(x_m, cells, at.cell[4 * z + 2]),
                  e = vector_at(x_m, cells, at.cell[4 * z + 3]);
      const Vec3f sum0 = b + a, difference0 = b - a, sum1 = e + d, difference1 = e - d;
      layer[z][0] = sum1 + sum0;
      layer[z][1] = difference1 + difference0;
      layer[z][2] = sum1 - sum0;
      layer[z][3] = difference1 - difference0;
    }
    const auto sum = [&](int m) { return layer[0][m] + layer[1][m]; };
    const auto difference = [&](int m) { return layer[1][m] - layer[0][m]; };
    const CubeModes f =
        cube.force({sum(1), sum(2), difference(0), sum(3), difference(2), difference(1), difference(3)},
                   stiffness[c], c);
    for (int q = 0; q < 8; ++q) {
      const float x = (q & 1) != 0 ? 1.F : -1.F, y = (q & 2) != 0 ? 1.F : -1.F, z = (q & 4) != 0 ? 1.F : -1.F;
      f_N[8 * c + q] = z * f.z + x * (f.x + z * f.xz) + y * (f.y + z * f.yz) + (x * y) * (f.xy + z * f.xyz);
    }
  }
};

/// Corners of copies, sorted by node. Those of one node follow each other in ascending order of copies.
struct CornersOfNodes {
  View<const Index> first;         ///< per node that copies have: its first corner
  View<const std::uint32_t> node;  ///< per corner
  View<const Index> corner;        ///< 8 copy + q
  View<const Vec3f> f_N;           ///< eight per copy
  TACTUS_HD Index node_of(Index i) const { return static_cast<Index>(node[first[i]]); }
  TACTUS_HD Vec3f force(Index i) const {
    const std::uint32_t own = node[first[i]];
    Vec3f sum{};
    for (Index e = first[i]; e < node.size() && node[e] == own; ++e) sum += f_N[corner[e]];
    return sum;
  }
};

/// Virtual nodes move. Nodes that tiles move get the copies' forces as external acceleration.
struct MovePatchNodes {
  CornersOfNodes corners;
  View<const Index> cell;        ///< per node
  View<const Vec3f> outer_m_s2;  ///< per node that copies have: acceleration by external forces
  View<float> external_m_s2;     ///< out, 3 fields over cells
  MoveNodes move;
  Index first_virtual_cell;
  MoveNodes::Moment now = {};
  TACTUS_HD void load() { now = move.moment(); }
  TACTUS_HD void operator()(Index i) const {
    const Index c = cell[corners.node_of(i)];
    const Vec3f f = corners.force(i);
    if (c >= first_virtual_cell) return move(c, f, move.read(c), now);
    store_vector(external_m_s2, move.cells, c,
                 fused_add(outer_m_s2[i], move.inverse_mass_per_kg[c], turned_back(f, now.turn_rad)));
  }
};

/// External accelerations, which the copies' forces are added to.
struct KeepExternal {
  CornersOfNodes corners;
  View<const Index> cell;
  View<const float> external_m_s2;
  View<Vec3f> outer_m_s2;  ///< out
  Index cells;
  TACTUS_HD void operator()(Index i) const {
    outer_m_s2[i] = vector_at(external_m_s2, cells, cell[corners.node_of(i)]);
  }
};

/// Forces of the copies are added to those of the tiles.
struct AddPatchForces {
  CornersOfNodes corners;
  View<const Index> cell;
  View<float> f_N;  ///< 3 fields over cells
  Index cells, first_virtual_cell;
  TACTUS_HD void operator()(Index i) const {
    const Index c = cell[corners.node_of(i)];
    const Vec3f of_tiles = c < first_virtual_cell ? vector_at(f_N, cells, c) : Vec3f{};
    store_vector(f_N, cells, c, of_tiles + corners.force(i));
  }
};

/// Nodes that move on this device: some regular ones, and some of the patch.
struct OwnNodes {
  Index begin = 0, end = 0, patch_begin = 0, patch_end = 0;
  TACTUS_HD bool has(Index node) const {
    return (node >= begin && node < end) || (node >= patch_begin && node < patch_end);
  }
};

/// Extremes of 256 copies whose first node is the device's own.
struct FindCopyExtremes {
  static constexpr int kThreads = FindExtremes::kThreads;
  using Shared = FindExtremes::Shared;
  View<const embed::CubeNodes> copies;
  View<const CopyCells> corners;
  View<const Stiffness> stiffness;
  View<const float> x_m;  ///< 3 fields over cells
  OwnNodes own;
  View<CubeExtremes> out;
  Index cells;
  Index first_cube;  ///< number of the first copy
  float gradient_per_m;
  TACTUS_HD CubeExtremes of_copy(Index copy) const {
    if (!own.has(copies[copy].node[0])) return FindExtremes::kNone;
    Vec3f corner[8];
    for (int q = 0; q < 8; ++q) corner[q] = vector_at(x_m, cells, corners[copy].cell[q]);
    return FindExtremes::of_corners(corner, stiffness[copy], gradient_per_m, first_cube + copy);
  }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index first = b.index() * kThreads, count = min(Index{kThreads}, copies.size() - first);
    b.for_threads(count, [&](int t) { s.of[t] = of_copy(first + t); });
    FindExtremes::find_worst(b, s, count, out);
  }
};

/// Copies by cells instead of nodes.
struct FindCopyCells {
  View<const embed::CubeNodes> copies;
  View<const Index> cell;   ///< per node
  View<CopyCells> corners;  ///< out
  TACTUS_HD void operator()(Index c) const {
    for (int q = 0; q < 8; ++q) corners[c].cell[q] = cell[copies[c].node[q]];
  }
};

/// What corners are sorted by: their node, if copy and node are in use here.
struct KeyCorners {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  View<const embed::CubeNodes> copies;
  View<const Stiffness> stiffness;
  OwnNodes own;
  View<std::uint32_t> node;  ///< out
  View<Index> corner;        ///< out
  TACTUS_HD void operator()(Index e) const {
    const Index i = copies[e / 8].node[e % 8];
    node[e] = stiffness[e / 8].mu_Pa > 0.F && own.has(i) ? static_cast<std::uint32_t>(i) : kNone;
    corner[e] = e;
  }
};

/// 1 where the corners of another node begin.
struct FlagFirstCorners {
  View<const std::uint32_t> node;
  View<Index> is_first;
  TACTUS_HD void operator()(Index e) const {
    const std::uint32_t before = e == 0 ? KeyCorners::kNone : node[e - 1];
    is_first[e] = node[e] != KeyCorners::kNone && node[e] != before ? 1 : 0;
  }
};

}  // namespace tactus::tled
