#pragma once
/// Copies of cubes that were cut: their forces, and the nodes on which they act. They stand in lists beside
/// the dense tiles.
#include "tactus/tissue/embed_kernels.h"
#include "tactus/tissue/tled/summed_forces.h"
#include "tactus/tissue/tled/tled_kernels.h"

namespace tactus::tled {

inline Index copy_blocks(Index copies) { return ceil_div(copies, Index{kLanes}); }

/// Forces of each copy on its eight corners: the same modes as in ElementForces, summed in the same order. A
/// block has kLanes copies, which a CPU works out side by side.
template <class Cube>
struct CopyForces {
  static constexpr int kThreads = kLanes, kGrain = 8;
  using Shared = NoShared;
  View<const CopyCells> corners;    ///< per copy
  View<const Stiffness> stiffness;  ///< likewise; 0: no copy
  View<const float> x_m;            ///< 3 fields over cells
  View<Vec3f> f_N;                  ///< out: eight per copy
  View<const Index> used;           ///< (1) copies
  Index cells;
  Cube cube;
  TACTUS_HD void load() {
    if constexpr (LoadingKernel<Cube>) cube.load();
  }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index first = b.index() * kLanes, count = min(used[0] - first, Index{kLanes});
    if (Block::kIsLoop && count == kLanes) return exert_together(first);
    b.for_each_thread([&](int t) {
      if (t < count) exert_alone(first + t);
    });
  }

 private:
  TACTUS_HD void exert_alone(Index c) const {
    exert(
        c, stiffness[c], [&](int q) { return vector_at(x_m, cells, corners[c].cell[q]); },
        [&](int q, Vec3f f) { f_N[8 * c + q] = f; });
  }
  struct Lanes {
    float x[8][kLanes], y[8][kLanes], z[8][kLanes];  ///< of corners
    TACTUS_HD Vec3f get(int q, int t) const { return {x[q][t], y[q][t], z[q][t]}; }
    TACTUS_HD void set(int q, int t, Vec3f v) { x[q][t] = v.x, y[q][t] = v.y, z[q][t] = v.z; }
  };
  TACTUS_HD void exert_together(Index first) const {
    Lanes at, exerted;
    float mu_Pa[kLanes], lambda_Pa[kLanes], hourglass_N_m[kLanes];
    for (int t = 0; t < kLanes; ++t) {
      for (int q = 0; q < 8; ++q) at.set(q, t, vector_at(x_m, cells, corners[first + t].cell[q]));
      const Stiffness of = stiffness[first + t];
      mu_Pa[t] = of.mu_Pa, lambda_Pa[t] = of.lambda_Pa, hourglass_N_m[t] = of.hourglass_N_m;
    }
#pragma omp simd
    for (int t = 0; t < kLanes; ++t)
      exert(
          first + t, {mu_Pa[t], lambda_Pa[t], hourglass_N_m[t]},
          [&](int q) TACTUS_ALWAYS_INLINE { return at.get(q, t); },
          [&](int q, Vec3f f) TACTUS_ALWAYS_INLINE { exerted.set(q, t, f); });
    for (int t = 0; t < kLanes; ++t)
      for (int q = 0; q < 8; ++q) f_N[8 * (first + t) + q] = exerted.get(q, t);
  }
  /// Sums over a layer of four nodes, with signs 1, x, y, xy.
  struct Layer {
    Vec3f all, x, y, xy;
    TACTUS_HD TACTUS_ALWAYS_INLINE static Layer of(Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
      const Vec3f sum0 = b + a, difference0 = b - a, sum1 = d + c, difference1 = d - c;
      return {sum1 + sum0, difference1 + difference0, sum1 - sum0, difference1 - difference0};
    }
  };
  /// Without loops: g++ leaves a loop over lanes that holds two of them alone.
  /// @param x_of(q) position of a corner @param report(q, f) takes its force
  template <class X, class F>
  TACTUS_HD TACTUS_ALWAYS_INLINE void exert(Index c, const Stiffness& of, X&& x_of, F&& report) const {
    const Layer low = Layer::of(x_of(0), x_of(1), x_of(2), x_of(3)),
                high = Layer::of(x_of(4), x_of(5), x_of(6), x_of(7));
    const CubeModes f = cube.force({low.x + high.x, low.y + high.y, high.all - low.all, low.xy + high.xy,
                                    high.y - low.y, high.x - low.x, high.xy - low.xy},
                                   of, c);
    const auto exert_on = [&](int q, float x, float y, float z) TACTUS_ALWAYS_INLINE {
      report(q, z * f.z + x * (f.x + z * f.xz) + y * (f.y + z * f.yz) + (x * y) * (f.xy + z * f.xyz));
    };
    exert_on(0, -1, -1, -1);
    exert_on(1, 1, -1, -1);
    exert_on(2, -1, 1, -1);
    exert_on(3, 1, 1, -1);
    exert_on(4, -1, -1, 1);
    exert_on(5, 1, -1, 1);
    exert_on(6, -1, 1, 1);
    exert_on(7, 1, 1, 1);
  }
};

/// Virtual nodes move. Nodes that tiles move get the copies' forces as external acceleration.
struct MoveVirtualNodes {
  static constexpr int kGrain = 256;
  CornersOfNodes corners;
  View<const Index> cell;        ///< per node
  View<const Vec3f> outer_m_s2;  ///< per node that copies have: acceleration by external forces
  View<float> external_m_s2;     ///< out, 3 fields over cells
  MoveNodes move;
  Index first_virtual_cell;
  MoveNodes::StepParameters now = {};
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
struct AddVirtualForces {
  CornersOfNodes corners;
  View<const Index> cell;
  SummedForces forces;
  View<float> f_N;  ///< out: 3 fields over cells; may be those of the tiles
  TACTUS_HD void operator()(Index i) const {
    const Index node = corners.node_of(i), c = cell[node];
    store_vector(f_N, forces.cells, c, forces.at(node, c));
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

/// Key by which corners are sorted: their node, if copy and node are in use here.
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

/// Thread: node that copies have. Where its corners begin, after all were set to -1.
struct NoteFirstCorners {
  CornersOfNodes corners;
  View<Index> first_of_node;
  TACTUS_HD void operator()(Index i) const { first_of_node[corners.node_of(i)] = corners.first[i]; }
};

}  // namespace tactus::tled
