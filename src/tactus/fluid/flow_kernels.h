#pragma once
/// Particles that come and go, and the ledgers of them.
#include "tactus/compute/fold.h"
#include "tactus/fluid/liquid_report.h"
#include "tactus/fluid/wall_kernels.h"

namespace tactus {

/// Counters that the device carries from step to step.
struct LiquidCounters {
  Index next_id = 0;
  std::uint32_t placed = 0, emitted = 0, taken = 0, replaced = 0;
};

/// Counts the particles that go on, and those of them that aren't copies of another device's.
struct KeepCount {
  View<const Index> placed, ghosts;
  View<Index> count, own;
  TACTUS_HD void operator()(Index) const {
    count[0] = placed[0];
    own[0] = placed[0] - ghosts[0];
  }
};

/// A disc from which particles come, one after the other as a pattern says (emitter_pattern.h). Their number
/// follows pi r^2 v t / d^3.
struct EmitterState {
  Vec3f velocity_m_s;
  double period_s = 0;  ///< of the pattern
  double from_s = 0, until_s = 0;
  Index first = 0, points = 0;       ///< of the pattern
  Index first_thread = 0, most = 0;  ///< particles in a step
  double time_s = 0;
  std::int64_t emitted = 0, waiting = 0;  ///< waiting: due, but there was no room for them
  // Those of this step:
  Index slot = 0, id = 0, come = 0;
  double now_s = 0;  ///< when one that comes now is on the disc
};

/// When the k-th particle of an emitter is on its disc, and how many are due until then.
struct EmitterTimes {
  EmitterState e;
  View<const float> phases;  ///< (0..1) of a period, ascending
  TACTUS_HD double due_s(std::int64_t k) const {
    const auto period = static_cast<double>(k / e.points);
    return e.from_s +
           (period + static_cast<double>(phases[e.first + static_cast<Index>(k % e.points)])) * e.period_s;
  }
  TACTUS_HD std::int64_t due(double until_s) const {
    if (!(until_s >= e.from_s)) return 0;
    const double periods = (until_s - e.from_s) / e.period_s;
    const auto whole = static_cast<std::int64_t>(periods);
    const auto rest = static_cast<float>(periods - static_cast<double>(whole));
    Index low = 0, high = e.points;  // the number of phases <= rest
    while (low < high) {
      const Index middle = (low + high) / 2;
      if (phases[e.first + middle] <= rest)
        low = middle + 1;
      else
        high = middle;
    }
    return whole * e.points + low;
  }
};

/// Decides which particles come: those that are due, of all emitters no more in a step than there is capacity
/// for.
struct PlanEmission {
  StepTime time;
  View<LiquidCounters> counters;
  View<Index> count, own;  ///< with copies, and without
  View<EmitterState> emitters;
  View<const float> phases;
  Index capacity;
  TACTUS_HD void load() { time.load(); }
  TACTUS_HD void operator()(Index) const {
    LiquidCounters c = counters[0];
    Index come = 0;
    for (Index k = 0; k < emitters.size(); ++k) {
      EmitterState e = emitters[k];
      e.come = 0;
      if (!time.settles()) {
        e.time_s += static_cast<double>(time.dt_s);
        const EmitterTimes times{e, phases};
        const std::int64_t left = times.due(min(e.time_s, e.until_s)) - e.emitted;
        e.come = static_cast<Index>(
            clamp(left, std::int64_t{0}, static_cast<std::int64_t>(min(e.most, capacity - come))));
        e.waiting = left - e.come;
        e.now_s = e.waiting > 0 && e.come > 0 ? times.due_s(e.emitted + e.come - 1) : e.time_s;
      }
      e.slot = count[0] + come;
      e.id = c.next_id;
      come += e.come;
      c.next_id += e.come;
      c.emitted += static_cast<std::uint32_t>(e.come);
      e.emitted += e.come;
      emitters[k] = e;
    }
    count[0] += come;
    own[0] += come;
    counters[0] = c;
  }
};

/// Thread: emitter. Time goes on for it although the liquid takes no step.
struct PassTime {
  View<EmitterState> emitters;
  double dt_s;
  TACTUS_HD void operator()(Index k) const { emitters[k].time_s += dt_s; }
};

/// Thread: particle that an emitter may bring.
struct EmitParticles {
  View<const EmitterState> emitters;
  View<const Vec3f> points_m;
  View<const float> phases;
  View<const Index> emitter_of;
  View<Vec3f> x_m, v_m_s;
  View<Index> id;
  View<float> push;
  TACTUS_HD void operator()(Index thread) const {
    const EmitterState& e = emitters[emitter_of[thread]];
    const Index k = thread - e.first_thread;
    if (k >= e.come) return;
    const std::int64_t number = e.emitted - e.come + k;
    const auto age_s = static_cast<float>(e.now_s - EmitterTimes{e, phases}.due_s(number));
    const Index i = e.slot + k;
    x_m[i] = points_m[e.first + static_cast<Index>(number % e.points)] + age_s * e.velocity_m_s;
    v_m_s[i] = e.velocity_m_s;
    push[i] = 0;
    id[i] = e.id + k;
  }
};

/// Adds up the impulses that walls got from one part since the frame began, and empties them. Thread:
/// collider.
struct SumWalls {
  View<WallSumsCopy> copies;
  View<WallSums> totals;
  TACTUS_HD void operator()(Index collider) const {
    const Index first = collider * WallSumsCopy::kOfEach;
    WallSums total{};
    for (Index c = first; c < first + WallSumsCopy::kOfEach; ++c)
      for (int a = 0; a < 3; ++a) total.impulse[a] += copies[c].sums.impulse[a];
    for (Index c = first; c < first + WallSumsCopy::kOfEach; ++c) copies[c].sums = {};
    totals[collider] = total;
  }
};

/// The report of one part, in kReports pieces: a block makes each.
struct ReportLiquid {
  static constexpr int kThreads = 256;
  static constexpr Index kReports = 32;
  View<const Index> count;
  View<const Vec3f> x_m, v_m_s;
  View<const float> density_kg_m3, push, relative_m_s;  ///< of the last step
  View<const LiquidCounters> counters;
  View<const EmitterState> emitters;
  float max_speed_m_s, inverse_density, spacing_m;
  View<LiquidReport> reports;  ///< (kReports)
  struct Shared {
    LiquidReport of[kThreads];
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    b.for_each_thread([&](int t) {
      LiquidReport r;
      for (Index i = b.index() * kThreads + t; i < count[0]; i += kReports * kThreads) {
        if (!(abs(x_m[i].x) < 1e9F)) continue;
        const float speed = length(v_m_s[i]);
        ++r.here;
        r.fast += speed > max_speed_m_s ? 1 : 0;
        const float density = density_kg_m3[i] * inverse_density;
        r.fastest_m_s = max(r.fastest_m_s, speed);
        if (density >= 0.5F) r.fastest_together_m_s = max(r.fastest_together_m_s, speed);
        r.densest = max(r.densest, density);
        r.borne += borne(i);
        r.excess += static_cast<std::uint64_t>(clamp(density - 1.F, 0.F, LiquidReport::kMostExcess) *
                                               LiquidReport::kExcessUnits);
        r.quartic += LiquidReport::quartic_of(relative_m_s[i] / max_speed_m_s);
        r.low_m = min(r.low_m, x_m[i]);
        r.high_m = max(r.high_m, x_m[i]);
      }
      s.of[t] = r;
    });
    fold<kThreads>(b, kThreads, [&](int t, int other) { s.of[t].add(s.of[other]); });
    b.on_one_thread([&] {
      LiquidReport r = s.of[0];
      if (b.index() == 0) add_ledger(r);
      reports[b.index()] = r;
    });
  }

 private:
  TACTUS_HD std::uint64_t borne(Index i) const {
    const float a_m_s2 = push[i] * sqr(density_kg_m3[i]) * inverse_density / spacing_m;
    return static_cast<std::uint64_t>(clamp(a_m_s2, 0.F, 1e6F) * LiquidReport::kBorneUnits);
  }
  TACTUS_HD void add_ledger(LiquidReport& r) const {
    r.placed = counters[0].placed;
    r.emitted = counters[0].emitted;
    r.taken = counters[0].taken;
    r.replaced = counters[0].replaced;
    for (Index k = 0; k < emitters.size(); ++k) r.waiting += static_cast<std::uint32_t>(emitters[k].waiting);
  }
};

}  // namespace tactus
