#pragma once
/// Kernels of fast lattice shape matching. Fields are arrays over the cells of FlsmGrid, one after the other.
///
/// Sums over regions in O(1) per node, for any half width w: a region that is box ∩ body is a window along x,
/// then y, then z. Because rest positions are k spacings away from the centre node, `sum m~ x k^T` needs only
/// first moments: 3 fields (m~ x) become 6 after x (window sums S0, and S1 = sum k f along x), 9 after y, 12
/// after z. The goals are the transpose: 12 fields -> 9 -> 6 -> 3. Along y and z windows slide (one value
/// enters, one leaves), in chunks of fixed place, so the bits don't depend on the split among threads and
/// devices; along x, where lanes lie side by side, they are added directly. Sums are double: A_r is right to
/// float32 round-off wherever in the world the body is (float32 sums lose 17 % of A_r one metre off the
/// origin). For w = 1 near_kernels.h takes the place of what slides.
#include "tactus/frame/frame_params.h"
#include "tactus/tissue/flsm/flsm_regions.h"
#include "tactus/tissue/flsm/region_rotation.h"
#include "tactus/tissue/flsm/step_parameters.h"

namespace tactus::flsm {

inline constexpr int kLanes = FlsmGrid::kLanes;

/// m~ (x + damping_time v): summed over regions. [ours] Goals of the positions a little ahead damp all motion
/// except rigid motion, as the region damping of Rivers & James 2007 does, at no cost of its own.
struct LoadNodes {
  static constexpr Index kGrain = 512;
  View<const Vec3f> x_m, v_m_s;
  View<const Index> node;  ///< of the state, per node here; empty: the same
  View<const double> shared_mass_kg;
  View<const Index> cell;
  View<double> out;  ///< 3 fields
  Index cells;
  StepTime time;
  StepParameters step;
  float damping_time_s = 0;
  TACTUS_HD void load() {
    time.load();
    damping_time_s = step.damping_time_s(step.dt_s(time));
  }
  TACTUS_HD void operator()(Index i) const {
    const Index there = node.empty() ? i : node[i];
    const Vec3f x = x_m[there], v = v_m_s[there];
    const double m = shared_mass_kg[i], t = static_cast<double>(damping_time_s);
    const Index d = cell[i];
    out[d] = m * (static_cast<double>(x.x) + t * static_cast<double>(v.x));
    out[cells + d] = m * (static_cast<double>(x.y) + t * static_cast<double>(v.y));
    out[2 * cells + d] = m * (static_cast<double>(x.z) + t * static_cast<double>(v.z));
  }
};

// Where a kernel makes several fields of the same rows or blocks, each is a block of threads of its own:
// field i % fields of row i / fields. A GPU is slow at long chains of loads.

/// Values that enter and leave a window of 2 w + 1 cells as it slides on, kChunk - 1 times. A GPU's thread
/// reads all of it before it writes sums: afterwards each would be waited for.
template <class Block, class T>
class Passing {
 public:
  /// @param from the window's first centre, of thread 0
  TACTUS_HD Passing(const Block& b, View<const T> in, Index from, Index step, int w)
      : in_(in), enter_(from + (w + 1) * step), leave_(from - w * step), step_(step) {
    if constexpr (!Block::kIsLoop)
      b.for_each_thread([&](int t) {
        for (Index j = 0; j < kSlides; ++j)
          entering_[j] = in[enter_ + j * step + t], leaving_[j] = in[leave_ + j * step + t];
      });
  }
  TACTUS_HD TACTUS_ALWAYS_INLINE double enters(Index j, int t) const {
    return static_cast<double>(Block::kIsLoop ? in_[enter_ + j * step_ + t] : entering_[j]);
  }
  TACTUS_HD TACTUS_ALWAYS_INLINE double leaves(Index j, int t) const {
    return static_cast<double>(Block::kIsLoop ? in_[leave_ + j * step_ + t] : leaving_[j]);
  }

 private:
  static constexpr Index kSlides = FlsmGrid::kChunk - 1;
  View<const T> in_;
  Index enter_, leave_, step_;
  T entering_[Block::kIsLoop ? 1 : kSlides], leaving_[Block::kIsLoop ? 1 : kSlides];
};

/// Window sums along x: 3 fields -> S0 (3), S1 (3).
struct RowSums {
  static constexpr int kThreads = kLanes;
  static constexpr Index kGrain = 96;
  using Shared = NoShared;
  View<const Index> rows;
  View<const double> in;
  View<double> out;
  Index cells;
  int w;
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index from = b.index() % 3 * cells + rows[b.index() / 3];
    typename Block::template PerThread<double> s0, s1;
    b.for_each_thread([&](int t) { s0[t] = in[from + t], s1[t] = 0; });
    for (int k = 1; k <= w; ++k) {
      b.for_each_thread([&](int t) {
        const double high = in[from + t + k], low = in[from + t - k];
        s0[t] += high + low;
        s1[t] += static_cast<double>(k) * (high - low);
      });
    }
    b.for_each_thread([&](int t) { out[from + t] = s0[t], out[from + 3 * cells + t] = s1[t]; });
  }
};

/// Window sums along y or z (`step` cells apart): `fields` -> S0 of all, S1 of the first three.
struct SlideSums {
  static constexpr int kThreads = kLanes;
  static constexpr Index kGrain = 64;
  using Shared = NoShared;
  View<const Index> blocks;
  View<const double> in;
  View<double> out;
  Index cells, step;
  int w, fields;

  /// S0 of the field at `from` to the same place of `out`, and its S1 to `moment`.
  template <bool kMoment, class Block>
  TACTUS_HD void slide(const Block& b, Index from, Index moment) const {
    typename Block::template PerThread<double> s0, s1;
    const Passing<Block, double> passing(b, in, from, step, w);
    b.for_each_thread([&](int t) { s0[t] = 0, s1[t] = 0; });
    for (int k = -w; k <= w; ++k) {
      b.for_each_thread([&](int t) {
        const double f = in[from + k * step + t];
        s0[t] += f;
        if constexpr (kMoment) s1[t] += static_cast<double>(k) * f;
      });
    }
    for (Index j = 0; j + 1 < FlsmGrid::kChunk; ++j) {
      b.for_each_thread([&](int t) {
        const double e = passing.enters(j, t), l = passing.leaves(j, t), sum = s0[t];
        out[from + j * step + t] = sum;
        if constexpr (kMoment) {
          const double first = s1[t];
          out[moment + j * step + t] = first;
          s1[t] = first + (static_cast<double>(w) * e + static_cast<double>(w + 1) * l - sum);
        }
        s0[t] = sum + (e - l);
      });
    }
    const Index last = (FlsmGrid::kChunk - 1) * step;
    b.for_each_thread([&](int t) {
      out[from + last + t] = s0[t];
      if constexpr (kMoment) out[moment + last + t] = s1[t];
    });
  }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index base = blocks[b.index() / fields], c = b.index() % fields;
    if (c < 3)
      slide<true>(b, c * cells + base, (fields + c) * cells + base);
    else
      slide<false>(b, c * cells + base, 0);
  }
};

/// Regions that are not box ∩ body: takes the nodes out of reach off the 12 sums, or sums the reached anew.
/// Thread: coordinate i % 3 of exception i / 3.
struct CorrectSums {
  static constexpr Index kGrain = 256;
  View<const FlsmException> exceptions;
  View<const FlsmOffset> offsets;
  View<const double> in;  ///< m~ x, 3 fields
  View<double> sums;      ///< 12 fields
  Index cells, stride_y, stride_z;
  TACTUS_HD void operator()(Index i) const {
    const FlsmException e = exceptions[i / 3];
    const Index a = i % 3;
    const auto field = [&](Index c) { return (3 * c + a) * cells + e.cell; };
    double s[4];
    for (Index c = 0; c < 4; ++c) s[c] = e.anew != 0 ? 0.0 : sums[field(c)];
    const double sign = e.anew != 0 ? 1 : -1;
    for (Index j = e.begin; j < e.end; ++j) {
      const FlsmOffset k = offsets[j];
      const double f = sign * in[a * cells + e.cell + k.z * stride_z + k.y * stride_y + k.x];
      s[0] += f;
      s[1] += static_cast<double>(k.x) * f;
      s[2] += static_cast<double>(k.y) * f;
      s[3] += static_cast<double>(k.z) * f;
    }
    for (Index c = 0; c < 4; ++c) sums[field(c)] = s[c];
  }
};

/// From the 12 sums: centre C_r [P 9], A_r = sum m~ x x0^T - M C C0^T [P 10], rotation R_r (warm-started, a
/// fixed number of steps), and T_r = [R_r | C_r - R_r C0_r] [P 11] with C0_r relative to node r.
struct FitRegions {
  static constexpr int kThreads = kLanes;
  static constexpr Index kGrain = 16;
  using Shared = NoShared;
  View<const Index> rows;
  View<const double> sums;          ///< 12 fields
  View<const double> inverse_mass;  ///< 1 field: weight over mass of the region; 0: no node
  View<const float> turn_m;         ///< 1 field: weight times spacing; 0: no node
  View<const double> center;        ///< 3 fields [spacings]
  View<float> quaternion;           ///< 4 fields w x y z, kept from step to step
  View<float> rotation;             ///< out: 9 fields, column by column, times weight and spacing; 0: no node
  View<double> translation_m;       ///< out: 3 fields, times the weight
  Index cells;
  double inverse_spacing_per_m;
  int iterations;
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index base = rows[b.index()];
    typename Block::template PerThread<float> A[9], q[4], scale;
    for (Index j = 0; j < 3; ++j)
      for (Index a = 0; a < 3; ++a)
        b.for_each_thread([&](int t) {
          const Index d = base + t;
          A[3 * j + a][t] = static_cast<float>(
              (sums[(3 + 3 * j + a) * cells + d] - sums[a * cells + d] * center[j * cells + d]) *
              inverse_mass[d] * inverse_spacing_per_m);
        });
    for (Index c = 0; c < 4; ++c)
      b.for_each_thread([&](int t) { q[c][t] = quaternion[c * cells + base + t]; });
    b.for_each_thread([&](int t) {
      const float square = A[0][t] * A[0][t] + A[1][t] * A[1][t] + A[2][t] * A[2][t] + A[3][t] * A[3][t] +
                           A[4][t] * A[4][t] + A[5][t] * A[5][t] + A[6][t] * A[6][t] + A[7][t] * A[7][t] +
                           A[8][t] * A[8][t];
      scale[t] = 1.F / sqrt(square > 1e-30F ? square : 1e-30F);
    });
    for (Index c = 0; c < 9; ++c) b.for_each_thread([&](int t) { A[c][t] *= scale[t]; });
    for (int n = 0; n < iterations; ++n) {
      b.for_each_thread([&](int t) {
        const Quatf r = improve_rotation(
            {q[0][t], q[1][t], q[2][t], q[3][t]},
            {{A[0][t], A[1][t], A[2][t]}, {A[3][t], A[4][t], A[5][t]}, {A[6][t], A[7][t], A[8][t]}});
        q[0][t] = r.w, q[1][t] = r.x, q[2][t] = r.y, q[3][t] = r.z;
      });
    }
    b.for_each_thread([&](int t) {
      const Columns R = rotation_columns({q[0][t], q[1][t], q[2][t], q[3][t]});
      const float h = turn_m[base + t];
      A[0][t] = h * R.x.x, A[1][t] = h * R.x.y, A[2][t] = h * R.x.z;
      A[3][t] = h * R.y.x, A[4][t] = h * R.y.y, A[5][t] = h * R.y.z;
      A[6][t] = h * R.z.x, A[7][t] = h * R.z.y, A[8][t] = h * R.z.z;
    });
    for (Index c = 0; c < 4; ++c)
      b.for_each_thread([&](int t) { quaternion[c * cells + base + t] = q[c][t]; });
    for (Index c = 0; c < 9; ++c) b.for_each_thread([&](int t) { rotation[c * cells + base + t] = A[c][t]; });
    for (Index a = 0; a < 3; ++a)
      b.for_each_thread([&](int t) {
        const Index d = base + t;
        translation_m[a * cells + d] =
            sums[a * cells + d] * inverse_mass[d] -
            (static_cast<double>(A[a][t]) * center[d] + static_cast<double>(A[3 + a][t]) * center[cells + d] +
             static_cast<double>(A[6 + a][t]) * center[2 * cells + d]);
      });
  }
};

/// Goals along z (columns = 3), then y (2): sums of T_r x0_i over the regions that hold i. Region i + k sees
/// node i at -k, so the last column enters with minus its first moment: translation' = S0(translation) -
/// S1(last column); the other columns are just summed.
struct SlideGoals {
  static constexpr int kThreads = kLanes;
  static constexpr Index kGrain = 64;
  using Shared = NoShared;
  View<const Index> blocks;
  View<const double> translation_in;
  View<const float> rotation_in;
  View<double> translation_out;
  View<float> rotation_out;
  Index cells, step;
  int w, columns;

  template <class Block>
  TACTUS_HD void sum_translation(const Block& b, Index base, Index a) const {
    const Index from = a * cells + base, turn = (3 * (columns - 1) + a) * cells + base;
    typename Block::template PerThread<double> s0, r0, r1;
    const Passing<Block, double> moved(b, translation_in, from, step, w);
    const Passing<Block, float> turned_by(b, rotation_in, turn, step, w);
    b.for_each_thread([&](int t) { s0[t] = 0, r0[t] = 0, r1[t] = 0; });
    for (int k = -w; k <= w; ++k) {
      b.for_each_thread([&](int t) {
        const double r = static_cast<double>(rotation_in[turn + k * step + t]);
        s0[t] += translation_in[from + k * step + t];
        r0[t] += r;
        r1[t] += static_cast<double>(k) * r;
      });
    }
    for (Index j = 0; j + 1 < FlsmGrid::kChunk; ++j) {
      b.for_each_thread([&](int t) {
        const double e = turned_by.enters(j, t), l = turned_by.leaves(j, t);
        const double sum = s0[t], turned = r0[t], first = r1[t];
        translation_out[from + j * step + t] = sum - first;
        r1[t] = first + (static_cast<double>(w) * e + static_cast<double>(w + 1) * l - turned);
        r0[t] = turned + (e - l);
        s0[t] = sum + (moved.enters(j, t) - moved.leaves(j, t));
      });
    }
    const Index last = from + (FlsmGrid::kChunk - 1) * step;
    b.for_each_thread([&](int t) { translation_out[last + t] = s0[t] - r1[t]; });
  }
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index fields = 3 * columns, base = blocks[b.index() / fields], field = b.index() % fields;
    if (field < 3)
      sum_translation(b, base, field);
    else
      sum_rotation(b, (field - 3) * cells + base);
  }
  template <class Block>
  TACTUS_HD void sum_rotation(const Block& b, Index from) const {
    typename Block::template PerThread<double> r0;
    const Passing<Block, float> turned_by(b, rotation_in, from, step, w);
    b.for_each_thread([&](int t) { r0[t] = 0; });
    for (int k = -w; k <= w; ++k)
      b.for_each_thread([&](int t) { r0[t] += static_cast<double>(rotation_in[from + k * step + t]); });
    for (Index j = 0; j + 1 < FlsmGrid::kChunk; ++j) {
      b.for_each_thread([&](int t) {
        const double sum = r0[t];
        rotation_out[from + j * step + t] = static_cast<float>(sum);
        r0[t] = sum + (turned_by.enters(j, t) - turned_by.leaves(j, t));
      });
    }
    const Index last = from + (FlsmGrid::kChunk - 1) * step;
    b.for_each_thread([&](int t) { rotation_out[last + t] = static_cast<float>(r0[t]); });
  }
};

/// Goals along x, the last step: sum of T_r x0_i over all regions that hold i.
struct RowGoals {
  static constexpr int kThreads = kLanes;
  static constexpr Index kGrain = 96;
  using Shared = NoShared;
  View<const Index> rows;
  View<const double> translation_in;
  View<const float> rotation_in;
  View<double> goal_sum_m;
  Index cells;
  int w;
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    typename Block::template PerThread<double> s;
    const Index from = b.index() % 3 * cells + rows[b.index() / 3];
    b.for_each_thread([&](int t) { s[t] = translation_in[from + t]; });
    for (int k = 1; k <= w; ++k) {
      b.for_each_thread([&](int t) {
        const double turn =
            static_cast<double>(rotation_in[from + t + k]) - static_cast<double>(rotation_in[from + t - k]);
        s[t] += translation_in[from + t + k] + translation_in[from + t - k] - static_cast<double>(k) * turn;
      });
    }
    b.for_each_thread([&](int t) { goal_sum_m[from + t] = s[t]; });
  }
};

/// The goals of nodes whose region is not box ∩ body (reach is symmetric: the same lists).
/// Thread: coordinate i % 3 of exception i / 3.
struct CorrectGoals {
  static constexpr Index kGrain = 256;
  View<const FlsmException> exceptions;
  View<const FlsmOffset> offsets;
  View<const double> translation_m;
  View<const float> rotation;
  View<double> goal_sum_m;
  Index cells, stride_y, stride_z;
  TACTUS_HD void operator()(Index i) const {
    const FlsmException e = exceptions[i / 3];
    const Index a = i % 3;
    double s = e.anew != 0 ? 0.0 : goal_sum_m[a * cells + e.cell];
    const double sign = e.anew != 0 ? 1 : -1;
    for (Index j = e.begin; j < e.end; ++j) {
      const FlsmOffset k = offsets[j];
      const Index d = e.cell + k.z * stride_z + k.y * stride_y + k.x;
      const double turn = static_cast<double>(k.x) * static_cast<double>(rotation[a * cells + d]) +
                          static_cast<double>(k.y) * static_cast<double>(rotation[(3 + a) * cells + d]) +
                          static_cast<double>(k.z) * static_cast<double>(rotation[(6 + a) * cells + d]);
      s += sign * (translation_m[a * cells + d] - turn);
    }
    goal_sum_m[a * cells + e.cell] = s;
  }
};

/// [P 12] and [P 13-14]: v+ = v + kappa (g - x)/dt + dt F_ext/m, x+ = x + dt v+. Fixed nodes stay where they
/// are.
struct Integrate {
  View<Vec3f> x_m, v_m_s;
  View<const Vec3f> f_ext_N;
  View<const double> goal_sum_m;
  View<const Index> cell;
  View<const double> inverse_weight;
  View<const float> held;  ///< FlsmRegions::held
  View<const float> mass_kg;
  View<const Index> fixed;  ///< HeldAxes
  Index cells;
  StepTime time;
  StepParameters step;
  float drag_per_s;
  float dt_s = 0, kick_s = 0;
  float stiffness_per_s = 0;           ///< kappa / dt
  float damping_time_s = 0, drag = 1;  ///< drag: share of the velocity that it leaves
  Vec3f turn_rad{};
  TACTUS_HD void load() {
    time.load();
    dt_s = step.dt_s(time);
    kick_s = time.kick_s * static_cast<float>(step.substeps);
    stiffness_per_s = step.kappa(dt_s) / sqr(dt_s) * kick_s;
    damping_time_s = step.damping_time_s(dt_s);
    turn_rad = time.turn_rad(damping_time_s, dt_s);
    drag = 1 / (1 + dt_s * drag_per_s);
  }
  TACTUS_HD void operator()(Index i) const {
    const Index d = cell[i];
    const Vec3f x = x_m[i], v = v_m_s[i];
    const double n = inverse_weight[i];
    const auto pull = [&](Index a, float xa, float va) {
      const double ahead =
          static_cast<double>(xa) + static_cast<double>(damping_time_s) * static_cast<double>(va);
      return static_cast<float>(goal_sum_m[a * cells + d] * n - ahead);
    };
    const Vec3f to_goal = turned_back({pull(0, x.x, v.x), pull(1, x.y, v.y), pull(2, x.z, v.z)}, turn_rad);
    const Vec3f dv =
        (held[i] * stiffness_per_s) * to_goal + kick_s * (time.gravity_m_s2 + f_ext_N[i] / mass_kg[i]);
    const Vec3f next = free_part(drag * (v + dv), fixed[i]);
    v_m_s[i] = next;
    x_m[i] = x + dt_s * next;
  }
};

}  // namespace tactus::flsm
