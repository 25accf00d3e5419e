#pragma once
/// Total Lagrangian explicit dynamics on a lattice of congruent cubes [P 3-7]: nodes come into cells,
/// internal forces move them there (element_forces.h), and they go back.
#include "tactus/frame/frame_params.h"
#include "tactus/geom/arrays/vector_fields.h"
#include "tactus/tissue/tled/element_forces.h"

namespace tactus::tled {

/// x + damping_time v into the cells. [ours] Forces of the positions a little ahead are viscous forces of the
/// elements: they damp no rigid motion.
struct LoadPositions {
  View<const Vec3f> x_m, v_m_s;
  View<const Index> cell;
  View<float> predicted_m;  ///< out, 3 fields
  Index cells;
  float damping_time_s;
  TACTUS_HD void operator()(Index i) const {
    store_vector(predicted_m, cells, cell[i], x_m[i] + damping_time_s * v_m_s[i]);
  }
};

/// All that moves into the cells, where neighbours stand beside one another.
struct LoadNodes {
  LoadPositions positions;
  View<const Vec3f> f_ext_N;
  View<const float> inverse_mass_per_kg;  ///< over cells
  View<float> other_predicted_m, v_m_s,
      external_m_s2;  ///< out, 3 fields each; nodes without elements stay in both
  TACTUS_HD void operator()(Index i) const {
    positions(i);
    const Index d = positions.cell[i], cells = positions.cells;
    store_vector(other_predicted_m, cells, d, vector_at(positions.predicted_m, cells, d));
    store_vector(v_m_s, cells, d, positions.v_m_s[i]);
    store_vector(external_m_s2, cells, d, inverse_mass_per_kg[d] * f_ext_N[i]);
  }
};

/// And back. Fixed nodes have not moved.
struct StoreNodes {
  View<const float> after_even_m, after_odd_m;  ///< positions ahead after so many moves, 3 fields each
  MoveCount moves;
  View<const float> v_m_s;  ///< 3 fields
  View<const Index> cell;
  View<Vec3f> x_out_m, v_out_m_s;
  Index cells;
  float damping_time_s;
  TACTUS_HD void load() {
    moves.load();
    if (moves.is_odd()) after_even_m = after_odd_m;
  }
  TACTUS_HD void operator()(Index i) const {
    const Vec3f v = vector_at(v_m_s, cells, cell[i]);
    x_out_m[i] = vector_at(after_even_m, cells, cell[i]) - damping_time_s * v;
    v_out_m_s[i] = v;
  }
};

/// The history that an odd number of moves left is where the next frame's first move reads it.
struct KeepHistory {
  View<const float> after_odd_Pa;
  View<float> history_Pa;
  MoveCount moves;
  TACTUS_HD void load() { moves.load(); }
  TACTUS_HD void operator()(Index i) const {
    if (moves.is_odd()) history_Pa[i] = after_odd_Pa[i];
  }
};

/// Sink for the internal forces at nodes, with the values of a node that it reads. This one keeps the forces,
/// three fields over cells.
struct StoreForces {
  View<float> f_N;  ///< 3 fields
  Index cells;
  struct StepParameters {};
  TACTUS_HD static StepParameters moment() { return {}; }
  struct Node {};
  TACTUS_HD static Node read(Index) { return {}; }
  TACTUS_HD void operator()(Index cell, Vec3f f, Node, StepParameters) const {
    store_vector(f_N, cells, cell, f);
  }
};

/// Or they move their nodes at once. [P 7] in velocity form: v+ = v + dt (f_int + f_ext)/m + dt g, x+ = x +
/// dt v+ [ours: free flight drifts 1000 times less in float32 than with u+, u, u-], which for p = x + b v is
/// p+ = p + dt v+ + b (v+ - v). Fixed nodes stay where they are.
struct MoveNodes {
  View<const float> predicted_m, external_m_s2,
      inverse_mass_per_kg;              ///< 3, 3, 1 fields; mass 0: fixed, or no node
  View<float> v_m_s, next_predicted_m;  ///< 3 fields each
  Index cells;
  StepTime time;
  float drag_per_s, damping_time_s;
  /// Values that are the same for all nodes: blocks share them, which frees registers.
  struct StepParameters {
    float dt_s, kick_s;
    float drag;  ///< share of the velocity that drag leaves
    Vec3f gravity_m_s2;
    Vec3f turn_rad;  ///< of the body in damping_time
  };
  TACTUS_HD StepParameters moment() const {
    StepTime t = time;
    t.load();
    return {t.dt_s, t.kick_s, 1 / (1 + t.dt_s * drag_per_s), t.gravity_m_s2,
            t.turn_rad(damping_time_s, t.dt_s)};
  }
  struct Node {
    float inverse_mass_per_kg;
    Vec3f v_m_s, external_m_s2, predicted_m;
  };
  TACTUS_HD Node read(Index cell) const {
    return {inverse_mass_per_kg.constant(cell), vector_at(v_m_s, cells, cell),
            constant_vector_at(external_m_s2, cells, cell), constant_vector_at(predicted_m, cells, cell)};
  }
  TACTUS_HD void operator()(Index cell, Vec3f f, const Node& node, const StepParameters& now) const {
    const float w = node.inverse_mass_per_kg;
    const Vec3f v = node.v_m_s, f_now = turned_back(f, now.turn_rad);
    const Vec3f a = fused_add(now.gravity_m_s2 + node.external_m_s2, w, f_now);
    const Vec3f next = w > 0 && now.dt_s != 0 ? now.drag * fused_add(v, now.kick_s, a) : Vec3f{};
    store_vector(v_m_s, cells, cell, next);
    store_vector(next_predicted_m, cells, cell,
                 node.predicted_m + fused_add(damping_time_s * (next - v), now.dt_s, next));
  }
};

/// How far strain has raised the wave speed, sqrt(((lambda + mu/max(J, 0.1)^2) |cof F|^2 + mu) / (lambda + 2
/// mu)), and the smallest J, at the centres of cubes. One block, 256 cubes.
struct FindExtremes {
  static constexpr int kThreads = 256, kStrip = 16;
  static constexpr CubeExtremes kNone{-1, 0, 1e30F, 0, 0};  ///< better than any
  View<const Index> cube_cell;
  View<const float> x_m;  ///< 3 fields
  StiffnessKinds stiffness;
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
      const Index at =
          ((q & 1) != 0 ? grid.right_of(c) : c) + (q >> 1 & 1) * grid.stride_y + (q >> 2) * grid.stride_z;
      corner[q] = {x_m[at], x_m[grid.cells + at], x_m[2 * grid.cells + at]};
    }
    return of_corners(corner, stiffness[c], gradient_per_m, cube);
  }
  TACTUS_HD static CubeExtremes of_corners(const Vec3f (&corner)[8], const Stiffness& of,
                                           float gradient_per_m, Index cube) {
    GradientColumns F{};
    for (int q = 0; q < 4; ++q) {
      F.x += corner[2 * q + 1] - corner[2 * q];
      F.y += corner[q + 2 + (q & 2)] - corner[q + (q & 2)];
      F.z += corner[q + 4] - corner[q];
    }
    F = {gradient_per_m * F.x, gradient_per_m * F.y, gradient_per_m * F.z};
    const GradientColumns cof = cofactor(F);
    const float J = dot(F.x, cof.x), safe = max(J, kSmallestJ);
    const float mu = of.mu_Pa, lambda = of.lambda_Pa;
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
  /// A value that is not a number is worst, and stays; of equals the first.
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
    find_worst(b, s, count, out);
  }
  template <class Block>
  TACTUS_HD static void find_worst(const Block& b, Shared& s, Index count, View<CubeExtremes> out) {
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
