#pragma once
/// Sums over neighbours, the inner loop of particle methods.
#include "tactus/compute/wide_load.h"
#include "tactus/geom/neighbour_cells.h"

namespace tactus {

/// Visits, for every particle of `of`, all particles of `among` within reach: a block kernel, launched with
/// NeighbourSearch::groups(). `Pair` says what is done:
///
///   struct Density {                                        // rho_i = sum_j m W(x_ij)
///     template <int kLanes> struct Own { float rho[kLanes]; };          // one place for each of several i
///     template <int kLanes> void begin(Own<kLanes>& own, int t, Index i) const;  // particle i becomes lane
///     t template <int kLanes> void add(Own<kLanes>& own, int t, Index j, Vec3f d_m, float r2_m2, bool near)
///     const; template <int kLanes> void end(const Own<kLanes>& own, int t, Index i) const;
///   };
///
/// With `static constexpr bool kNearOnly = true`, add is called for what is near alone: for work that a loop
/// over lanes can't do.
///
/// i and j are slots of the two searches, d = x_j - x_i; a particle is its own neighbour. `add` may be called
/// for what is not near, and must add exactly nothing then (select a zero: on a CPU, it runs for eight i at
/// once). The order of the sums is that of NeighbourCells: the same bits on every device.
template <class Pair>
struct VisitNeighbours {
  static constexpr int kThreads = kVisitLanes;
  static constexpr int kGrain = 64;
  using Shared = NoShared;
  static constexpr Index kWidest = 2;  ///< cells from the first to the last particle of one run, at most

  NeighbourCells of, among;
  float reach_m2;
  Pair pair;

  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared&) const {
    const Index first = b.index() * kThreads, lanes = min(of.placed[0] - first, Index(kThreads));
    if constexpr (Block::kIsLoop) {
      visit_together(first, lanes);
    } else {
      b.for_each_thread([&](int t) {
        if (t < lanes) visit_alone(first + t);
      });
    }
  }

 private:
  using Own1 = typename Pair::template Own<1>;
  using Own8 = typename Pair::template Own<kThreads>;
  struct Lanes {
    float x[kThreads], y[kThreads], z[kThreads];
  };
  struct Runs {
    SlotRun run[(kWidest + 3) * 9];
    int count = 0;
  };

  TACTUS_HD void visit_alone(Index i) const {
    const Vec3f x = of.particles[i].x_m;
    Own1 own;
    pair.begin(own, 0, i);
    among.for_each_candidate(x, [&](Index j) {
      const SearchParticle other = load_constant(among.particles, j);
      const Vec3f d = other.x_m - x;
      const float r2 = dot(d, d);
      if (r2 <= reach_m2) pair.add(own, 0, j, d, r2, true);
    });
    pair.end(own, 0, i);
  }

  /// Lanes side by side in a row share their candidates; what is out of one lane's reach adds nothing there.
  TACTUS_HD void visit_together(Index first, int lanes) const {
    Own8 own;
    Lanes at;
    Vec3i cell[kThreads];
    for (int t = 0; t < kThreads; ++t) {
      const Index i = first + min(t, lanes - 1);
      const Vec3f x = of.particles[i].x_m;
      at.x[t] = x.x, at.y[t] = x.y, at.z[t] = x.z;
      cell[t] = among.hash.holds(x) ? among.hash.cell(x) : Vec3i{1 << 30, 1 << 30, 1 << 30};
      pair.begin(own, t, i);
    }
    for (int a = 0; a < lanes;) {
      int end = a + 1;
      Index low = cell[a].x, high = low;
      for (; end < lanes && cell[end].y == cell[a].y && cell[end].z == cell[a].z; ++end) {
        const Index x = cell[end].x, new_low = min(low, x), new_high = max(high, x);
        if (new_high - new_low > kWidest) break;
        low = new_low, high = new_high;
      }
      if (low < 1 << 30) {
        Runs runs;
        among.for_each_run({low - 1, cell[a].y - 1, cell[a].z - 1}, {high + 1, cell[a].y + 1, cell[a].z + 1},
                           [&](SlotRun run) {
                             runs.run[runs.count] = run;
                             runs.count += run.first < run.last ? 1 : 0;
                           });
        add_runs(own, a == 0 && end == lanes ? at : only(at, a, end), runs);
      }
      a = end;
    }
    for (int t = 0; t < lanes; ++t) pair.end(own, t, first + t);
  }

  /// Lanes outside of [begin, end) are nowhere: near nothing.
  TACTUS_HD static Lanes only(const Lanes& at, int begin, int end) {
    Lanes some = at;
    for (int t = 0; t < kThreads; ++t)
      if (t < begin || t >= end) some.x[t] = std::bit_cast<float>(0x7fc00000U);
    return some;
  }

  TACTUS_HD void add_runs(Own8& own, const Lanes& at, const Runs& runs) const {
    for (int r = 0; r < runs.count; ++r) {
      for (Index j = runs.run[r].first; j < runs.run[r].last; ++j) {
        if constexpr (near_only())
          add_near(own, at, j);
        else
          add_all(own, at, j);
      }
    }
  }
  TACTUS_HD void add_all(Own8& own, const Lanes& at, Index j) const {
    const Vec3f x = among.particles[j].x_m;
#pragma omp simd
    for (int t = 0; t < kThreads; ++t) {
      const float dx = x.x - at.x[t], dy = x.y - at.y[t], dz = x.z - at.z[t];
      const float r2 = dx * dx + dy * dy + dz * dz;
      pair.add(own, t, j, {dx, dy, dz}, r2, r2 <= reach_m2);
    }
  }
  TACTUS_HD void add_near(Own8& own, const Lanes& at, Index j) const {
    const Vec3f x = among.particles[j].x_m;
    std::uint32_t near = 0;
#pragma omp simd reduction(| : near)
    for (int t = 0; t < kThreads; ++t) {
      const float dx = x.x - at.x[t], dy = x.y - at.y[t], dz = x.z - at.z[t];
      near |= dx * dx + dy * dy + dz * dz <= reach_m2 ? 1U << t : 0U;
    }
    for (; near != 0; near &= near - 1) {
      const int t = std::countr_zero(near);
      const Vec3f d{x.x - at.x[t], x.y - at.y[t], x.z - at.z[t]};
      pair.add(own, t, j, d, dot(d, d), true);
    }
  }
  static constexpr bool near_only() {
    if constexpr (requires { Pair::kNearOnly; })
      return Pair::kNearOnly;
    else
      return false;
  }
};

}  // namespace tactus
