#pragma once
/// Total Lagrangian explicit dynamics on a lattice of congruent cubes [P 3-7].
///
/// Eight values at the corners of a cube are eight sums with signs (Walsh-Hadamard modes): a constant, three
/// gradients, and four hourglass modes, orthogonal because all cubes are cubes. Forces come back the same
/// way. Sums over corners, and over the cubes round a node, then separate by axis: x, y, z one after the
/// other as lattice columns are walked upwards, so that nothing per element and corner is ever stored.
#include "tactus/compute/kernel.h"
#include "tactus/tissue/tled/material_laws.h"
#include "tactus/tissue/vector_fields.h"

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

/// A CPU wants tiles as wide as its caches allow, a GPU many small ones.
inline constexpr int kGroupsOnCpu = 32, kGroupsOnGpu = 16;

/// Values of one cube as sums over its corners with the signs of x, y, z and their products.
struct CubeModes {
  Vec3f x, y, z, xy, yz, xz, xyz;
};

/// Forces of a cube with one integration point at its centre; the four hourglass modes, without stress there,
/// get stiffness k (Joldes et al. 2008): f = (k/8) sum h h^T u.
template <class Law>
struct OnePointCube {
  Law law;
  float gradient_per_m;  ///< 1 / (4 h)
  float area_m2;         ///< h^2 / 4
  TACTUS_HD CubeModes force(const CubeModes& u, float mu, float lambda, float hourglass,
                            Index /*cell*/) const {
    const float s = gradient_per_m;
    const GradientColumns P = law.stress({s * u.x, s * u.y, s * u.z}, mu, lambda);
    const float k = -0.125F * hourglass, a = -area_m2;
    return {a * P.x, a * P.y, a * P.z, k * u.xy, k * u.yz, k * u.xz, k * u.xyz};
  }
};

/// The same with 2x2x2 points: no hourglass modes, but it locks in bending. Kept as a check.
template <class Law>
struct EightPointCube {
  Law law;
  float gradient_per_m, area_m2;
  TACTUS_HD CubeModes force(const CubeModes& u, float mu, float lambda, float /*hourglass*/,
                            Index /*cell*/) const {
    CubeModes f{};
    const float g = 0.577350269F, w = -0.125F * area_m2, s = gradient_per_m;
    for (int i = 0; i < 8; ++i) {
      const float a = (i & 1) != 0 ? g : -g, b = (i & 2) != 0 ? g : -g, c = (i & 4) != 0 ? g : -g;
      const GradientColumns P = law.stress({s * (u.x + b * u.xy + c * u.xz + (b * c) * u.xyz),
                                            s * (u.y + a * u.xy + c * u.yz + (a * c) * u.xyz),
                                            s * (u.z + a * u.xz + b * u.yz + (a * b) * u.xyz)},
                                           mu, lambda);
      f.x += w * P.x;
      f.y += w * P.y;
      f.z += w * P.z;
      f.xy += w * (b * P.x + a * P.y);
      f.xz += w * (c * P.x + a * P.z);
      f.yz += w * (c * P.y + b * P.z);
      f.xyz += w * ((b * c) * P.x + (a * c) * P.y + (a * b) * P.z);
    }
    return f;
  }
};

/// A cube whose shear stress fades (Taylor et al. 2009). S = S_law - sum g_n with g_n' = (share_n S_shear -
/// g_n) / time_n, S_shear being the second Piola-Kirchhoff stress that mu gives: it does not turn with the
/// body. A step takes g_n + fade_n (share_n S_shear - g_n), fade_n = 1 - exp(-dt / time_n): exact for a held
/// strain, whatever the step. Cubes at a tile's border are seen by several tiles, which all write the same.
template <class Law>
struct RelaxingCube {
  static constexpr int kTerms = 2, kFields = 6 * kTerms;
  OnePointCube<Law> elastic;
  View<const float> before;  ///< g_n: xx, yy, zz, yz, zx, xy per term [Pa]; kFields fields over cells
  View<float> after;         ///< out
  Index cells;
  float share[kTerms], fade[kTerms];

  TACTUS_HD CubeModes force(const CubeModes& u, float mu, float lambda, float hourglass, Index cell) const {
    CubeModes f = elastic.force(u, mu, lambda, hourglass, cell);
    const float s = elastic.gradient_per_m, a = elastic.area_m2;
    const GradientColumns F{s * u.x, s * u.y, s * u.z}, P = elastic.law.stress(F, mu, 0.F), cof = cofactor(F);
    const float inverse_J = 1.F / max(dot(F.x, cof.x), kSmallestJ);  // F^-1 = cof^T / J
    const float S[6] = {inverse_J * dot(cof.x, P.x), inverse_J * dot(cof.y, P.y),
                        inverse_J * dot(cof.z, P.z), inverse_J * dot(cof.y, P.z),
                        inverse_J * dot(cof.z, P.x), inverse_J * dot(cof.x, P.y)};
    float g[6] = {};
    for (Index n = 0; n < kTerms; ++n) {
      for (Index i = 0; i < 6; ++i) {
        const Index at = (6 * n + i) * cells + cell;
        const float old = before[at], now = old + fade[n] * (share[n] * S[i] - old);
        after[at] = now;
        g[i] += now;
      }
    }
    f.x += a * (g[0] * F.x + g[5] * F.y + g[4] * F.z);
    f.y += a * (g[5] * F.x + g[1] * F.y + g[3] * F.z);
    f.z += a * (g[4] * F.x + g[3] * F.y + g[2] * F.z);
    return f;
  }
};

/// x + damping_time v into the cells. [ours] Forces of the positions a little ahead are viscous forces of the
/// elements: they damp no rigid motion.
struct LoadPositions {
  View<const Vec3f> x_m, v_m_s;
  View<const Index> cell;
  View<float> ahead_m;  ///< out, 3 fields
  Index cells;
  float damping_time_s;
  TACTUS_HD void operator()(Index i) const {
    store_vector(ahead_m, cells, cell[i], x_m[i] + damping_time_s * v_m_s[i]);
  }
};

/// All that moves into the cells, where neighbours stand beside one another.
struct LoadNodes {
  LoadPositions positions;
  View<const Vec3f> f_ext_N;
  View<const float> inverse_mass_per_kg;      ///< over cells
  View<float> ahead_too_m, v_m_s, push_m_s2;  ///< out, 3 fields each; nodes without elements stay in both
  TACTUS_HD void operator()(Index i) const {
    positions(i);
    const Index d = positions.cell[i], cells = positions.cells;
    store_vector(ahead_too_m, cells, d, vector_at(positions.ahead_m, cells, d));
    store_vector(v_m_s, cells, d, positions.v_m_s[i]);
    store_vector(push_m_s2, cells, d, inverse_mass_per_kg[d] * f_ext_N[i]);
  }
};

/// And back. What is fixed has not moved.
struct StoreNodes {
  View<const float> ahead_m, v_m_s;  ///< 3 fields each
  View<const Index> cell;
  View<Vec3f> x_out_m, v_out_m_s;
  Index cells;
  float damping_time_s;
  TACTUS_HD void operator()(Index i) const {
    const Vec3f v = vector_at(v_m_s, cells, cell[i]);
    x_out_m[i] = vector_at(ahead_m, cells, cell[i]) - damping_time_s * v;
    v_out_m_s[i] = v;
  }
};

/// What becomes of internal forces: they are kept, three fields over cells.
struct StoreForces {
  View<float> f_N;  ///< 3 fields
  Index cells;
  TACTUS_HD void operator()(Index cell, Vec3f f) const { store_vector(f_N, cells, cell, f); }
};

/// Or they move their nodes at once. [P 7] in velocity form: v+ = v + dt (f_int + f_ext)/m + dt g, x+ = x +
/// dt v+ [ours: free flight drifts 1000 times less in float32 than with u+, u, u-], which for p = x + b v is
/// p+ = p + dt v+ + b (v+ - v). Fixed nodes stay where they are.
struct MoveNodes {
  View<const float> ahead_m, push_m_s2, inverse_mass_per_kg;  ///< 3, 3, 1 fields; mass 0: fixed, or no node
  View<float> v_m_s, next_ahead_m;                            ///< 3 fields each
  Index cells;
  Vec3f gravity_m_s2;
  float dt_s, drag, damping_time_s;  ///< drag: 1 / (1 + dt drag_per_s)
  TACTUS_HD void operator()(Index cell, Vec3f f) const {
    const float w = inverse_mass_per_kg[cell];
    const Vec3f v = vector_at(v_m_s, cells, cell);
    const Vec3f dv = dt_s * (gravity_m_s2 + vector_at(push_m_s2, cells, cell) + w * f);
    const Vec3f next = w > 0 ? drag * (v + dv) : Vec3f{};
    store_vector(v_m_s, cells, cell, next);
    store_vector(next_ahead_m, cells, cell,
                 vector_at(ahead_m, cells, cell) + (dt_s * next + damping_time_s * (next - v)));
  }
};

/// Internal forces of all nodes [P 6]. One block is a tile; its columns are walked upwards, a layer of cubes
/// at a time, and what each layer exerts on the nodes below and above it is handed on in registers.
template <class Cube, int kMaxGroups, class Sink>
struct ElementForces {
  static constexpr int kLanes = 8, kThreads = kLanes * kMaxGroups;
  View<const Tile> tiles;
  View<const std::uint32_t> active;
  View<const float> x_m;        ///< 3 fields
  View<const float> stiffness;  ///< per cube: mu, lambda [Pa], hourglass k [N/m]; 3 fields
  Grid grid;
  Cube cube;
  Sink sink;

  struct Shared {
    Index cell[kMaxGroups];        ///< of each group's first column, in the lowest layer
    Index starts_row[kMaxGroups];  ///< 1: its first column belongs to the tile before
    /// Per node and row of columns: force with signs 1, y. Of odd and even layers: while one is read, the
    /// next is written.
    float row[2][2][3][kThreads];
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
      s.cell[g] = tile.first + g / tile.groups * grid.stride_y + g % tile.groups * kLanes;
      s.starts_row[g] = g % tile.groups == 0 ? 1 : 0;
    });
    b.template for_own_groups<kLanes>(
        groups, [](int) { return true; },
        [&](int g, int t) {
          float layer[4][3];
          load_layer(s.cell[g] + t, layer);
          for (int m = 0; m < 4; ++m) {
            for (int a = 0; a < 3; ++a) column.below[m][a][g * kLanes + t] = layer[m][a];
            for (int a = 0; a < 3; ++a) column.up[m][a][g * kLanes + t] = 0;
          }
        });
    for (Index z = 0; z <= tile.layers; ++z) {
      const std::uint32_t mask = active[tile.active + z];
      b.template for_own_groups<kLanes>(
          groups, [mask](int g) { return (mask >> g & 1U) != 0; },
          [&](int g, int t) { cross_cube(column, s.cell[g] + t + z * grid.stride_z, g * kLanes + t); });
      b.template for_own_groups<kLanes>(
          groups, [mask](int g) { return (mask >> g & 1U) == 0; },
          [&](int g, int t) { cross_void(column, s.cell[g] + t + z * grid.stride_z, g * kLanes + t); });
      if (z > 0) sum_nodes(b, column, s, tile, z);
    }
    b.barrier();
  }

 private:
  TACTUS_HD void load_layer(Index cell, float (&layer)[4][3]) const {
    for (Index a = 0; a < 3; ++a) {
      const Index c = a * grid.cells + cell;
      const float x00 = x_m[c], x10 = x_m[c + 1], x01 = x_m[c + grid.stride_y],
                  x11 = x_m[c + grid.stride_y + 1];
      const float s0 = x00 + x10, d0 = x10 - x00, s1 = x01 + x11, d1 = x11 - x01;
      layer[0][a] = s0 + s1;
      layer[1][a] = d0 + d1;
      layer[2][a] = s1 - s0;
      layer[3][a] = d1 - d0;
    }
  }

  template <class C>
  TACTUS_HD void cross_cube(C& column, Index cell, int i) const {
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
    const CubeModes f =
        cube.force(u, stiffness[cell], stiffness[grid.cells + cell], stiffness[2 * grid.cells + cell], cell);
    hand_on(column, 0, i, Vec3f{}, f.z);
    hand_on(column, 1, i, f.x, f.xz);
    hand_on(column, 2, i, f.y, f.yz);
    hand_on(column, 3, i, f.xy, f.xyz);
    for (int m = 0; m < 4; ++m) {
      for (int a = 0; a < 3; ++a) column.below[m][a][i] = above[m][a];
    }
  }

  /// Where there is no cube, only what the one below exerts is handed on.
  template <class C>
  TACTUS_HD void cross_void(C& column, Index cell, int i) const {
    float above[4][3];
    load_layer(cell + grid.stride_z, above);
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

  /// Forces on the own nodes of a layer: first from the columns left and right of each, then from the rows of
  /// columns before and behind.
  template <class Block, class C>
  TACTUS_HD void sum_nodes(const Block& b, const C& column, Shared& s, const Tile& tile, Index z) const {
    auto& rows = s.row[z & 1];
    const int row = tile.groups * kLanes, groups = tile.groups * tile.rows;
    typename Block::template PerThread<float> f[3];
    decltype(b.previous(column.on[0][0])) left[4][3];
    for (int m = 0; m < 4; ++m)
      for (int a = 0; a < 3; ++a) left[m][a] = b.previous(column.on[m][a]);
    b.template for_own_groups<kLanes>(
        groups, [](int) { return true; },
        [&](int g, int t) {
          const int i = g * kLanes + t;
          for (int y = 0; y < 2; ++y)
            for (int a = 0; a < 3; ++a) {
              const auto &even = column.on[2 * y][a], &odd = column.on[2 * y + 1][a];
              rows[y][a][i] = (left[2 * y][a][i] + left[2 * y + 1][a][i]) + (even[i] - odd[i]);
            }
        });
    b.barrier();
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
          const int i = g * kLanes + t;
          if (t > 0 || s.starts_row[g] == 0)
            sink(s.cell[g] + t + z * grid.stride_z, {f[0][i], f[1][i], f[2][i]});
        });
  }
};

/// The worst of some cubes.
struct CubeExtremes {
  float speed_ratio;  ///< fastest wave over that at rest
  Index fastest_cube;
  float smallest_J;
  Index smallest_cube;
  Index inverted;  ///< cubes with J <= 0
};

/// How far strain has raised the wave speed, sqrt(((lambda + mu/max(J, 0.1)^2) |cof F|^2 + mu) / (lambda + 2
/// mu)), and the smallest J, at the centres of cubes. One block, 256 cubes.
struct FindExtremes {
  static constexpr int kThreads = 256, kStrip = 16;
  View<const Index> cube_cell;
  View<const float> x_m, stiffness;  ///< 3 fields each
  View<CubeExtremes> out;
  Grid grid;
  float gradient_per_m;
  struct Shared {
    CubeExtremes of[kThreads];
  };

  TACTUS_HD CubeExtremes of_cube(Index cube) const {
    const Index c = cube_cell[cube];
    Vec3f corner[8];
    for (int q = 0; q < 8; ++q) {
      const Index at = c + (q & 1) + (q >> 1 & 1) * grid.stride_y + (q >> 2) * grid.stride_z;
      corner[q] = {x_m[at], x_m[grid.cells + at], x_m[2 * grid.cells + at]};
    }
    GradientColumns F{};
    for (int q = 0; q < 4; ++q) {
      F.x += corner[2 * q + 1] - corner[2 * q];
      F.y += corner[q + 2 + (q & 2)] - corner[q + (q & 2)];
      F.z += corner[q + 4] - corner[q];
    }
    F = {gradient_per_m * F.x, gradient_per_m * F.y, gradient_per_m * F.z};
    const GradientColumns cof = cofactor(F);
    const float J = dot(F.x, cof.x), safe = max(J, kSmallestJ);
    const float mu = stiffness[c], lambda = stiffness[grid.cells + c];
    const float area2 = dot(cof.x, cof.x) + dot(cof.y, cof.y) + dot(cof.z, cof.z);
    // |cof F|^2 of the spectral norm is at most the sum over columns, and at rest a third of it.
    const float ratio2 =
        ((lambda + mu / (safe * safe)) * max(largest_column2(cof), area2 * 0.3333333333F) + mu) /
        (lambda + 2.F * mu);
    return {mu > 0.F ? sqrt(ratio2) : 0.F, cube, mu > 0.F ? J : 1.F, cube, mu > 0.F && !(J > 0.F) ? 1 : 0};
  }
  TACTUS_HD static float largest_column2(const GradientColumns& m) {
    return max(dot(m.x, m.x), max(dot(m.y, m.y), dot(m.z, m.z)));
  }
  /// What is not a number is worst, and stays.
  TACTUS_HD static CubeExtremes worse(const CubeExtremes& a, const CubeExtremes& b) {
    CubeExtremes w = a;
    if (a.speed_ratio == a.speed_ratio && !(b.speed_ratio <= a.speed_ratio))
      w.speed_ratio = b.speed_ratio, w.fastest_cube = b.fastest_cube;
    if (a.smallest_J == a.smallest_J && !(b.smallest_J >= a.smallest_J))
      w.smallest_J = b.smallest_J, w.smallest_cube = b.smallest_cube;
    w.inverted = a.inverted + b.inverted;
    return w;
  }

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index first = b.index() * kThreads, count = min(Index{kThreads}, cube_cell.size() - first);
    b.for_threads(count, [&](int t) { s.of[t] = of_cube(first + t); });
    b.for_threads(ceil_div(count, kStrip), [&](int strip) {
      const int begin = strip * kStrip, end = min(begin + kStrip, static_cast<int>(count));
      for (int t = begin + 1; t < end; ++t) s.of[begin] = worse(s.of[begin], s.of[t]);
    });
    b.on_one_thread([&] {
      for (int t = kStrip; t < count; t += kStrip) s.of[0] = worse(s.of[0], s.of[t]);
      out[b.index()] = s.of[0];
    });
  }
};

}  // namespace tactus::tled
