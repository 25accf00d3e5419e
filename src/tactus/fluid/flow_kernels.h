#pragma once
/// Particles that come and go, and the ledgers of them.
#include "tactus/fluid/wall_kernels.h"

namespace tactus {

/// Particle counts since the liquid was placed, and its extremes now. Exactly: placed + emitted = here +
/// taken + replaced. The oldest are replaced when newer ones need their capacity; layers for which all of the
/// capacity is too little are waiting.
struct LiquidReport {
  Index here = 0;
  std::uint32_t placed = 0, emitted = 0, taken = 0, replaced = 0, waiting = 0;
  Index fast = 0;  ///< faster than max_speed_m_s now
  float fastest_m_s = 0;
  float densest = 0;  ///< largest density over that at rest
  /// Adds the report of another part of the liquid. The order of sums of integers and maxima doesn't matter.
  TACTUS_HD void add(const LiquidReport& part) {
    here += part.here;
    placed += part.placed;
    emitted += part.emitted;
    taken += part.taken;
    replaced += part.replaced;
    waiting += part.waiting;
    fast += part.fast;
    fastest_m_s = max(fastest_m_s, part.fastest_m_s);
    densest = max(densest, part.densest);
  }
};

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

/// A disc from which particles come, a layer of them whenever the last one has moved by d.
struct EmitterState {
  Vec3f velocity_m_s;
  float layer_s = 0;  ///< between layers
  double from_s = 0, until_s = 0;
  Index first = 0, points = 0;  ///< of the layers' points
  double time_s = 0, next_s = 0;
  Index waiting = 0;  ///< layers that are due and have more points than there is capacity in all
  // The layer of this step:
  Index slot = -1, id = 0;  ///< of its first particle; slot -1: none
  float age_s = 0;
};

/// Decides which layers come: those that are due, of all emitters no more points in a step than there is
/// capacity for particles.
struct PlanLayers {
  StepTime time;
  View<LiquidCounters> counters;
  View<Index> count, own;  ///< with copies, and without
  View<EmitterState> emitters;
  Index capacity;
  TACTUS_HD void load() { time.load(); }
  TACTUS_HD void operator()(Index) const {
    LiquidCounters c = counters[0];
    Index come = 0;
    for (Index k = 0; k < emitters.size(); ++k) {
      EmitterState e = emitters[k];
      if (!time.settles()) e.time_s += static_cast<double>(time.dt_s);
      e.slot = -1;
      const bool is_due = e.time_s >= e.next_s && e.next_s < e.until_s && !time.settles();
      if (is_due) {
        e.age_s = static_cast<float>(e.time_s - e.next_s);
        e.next_s += static_cast<double>(e.layer_s);
        ++e.waiting;
      }
      if (e.waiting > 0 && come + e.points <= capacity) {
        if (!is_due) e.age_s = 0;
        --e.waiting;
        e.slot = count[0] + come;
        e.id = c.next_id;
        come += e.points;
        c.next_id += e.points;
        c.emitted += static_cast<std::uint32_t>(e.points);
      }
      emitters[k] = e;
    }
    count[0] += come;
    own[0] += come;
    counters[0] = c;
  }
};

/// Thread: point of a layer.
struct EmitLayers {
  View<const EmitterState> emitters;
  View<const Vec3f> points_m;
  View<const Index> emitter_of;
  View<Vec3f> x_m, v_m_s;
  View<Index> id;
  View<float> push;
  TACTUS_HD void operator()(Index p) const {
    const EmitterState& e = emitters[emitter_of[p]];
    if (e.slot < 0) return;
    const Index i = e.slot + (p - e.first);
    x_m[i] = points_m[p] + e.age_s * e.velocity_m_s;
    v_m_s[i] = e.velocity_m_s;
    push[i] = 0;
    id[i] = e.id + (p - e.first);
  }
};

/// Adds up the impulses that walls got from one part since the frame began, and empties them. Thread:
/// collider.
struct SumWalls {
  View<WallSumsCopy> copies;
  View<WallSums> totals;
  TACTUS_HD void operator()(Index collider) const {
    WallSums total{};
    for (Index c = collider * WallSumsCopy::kOfEach; c < (collider + 1) * WallSumsCopy::kOfEach; ++c) {
      WallSums& sums = copies[c].sums;
      for (int a = 0; a < 3; ++a) {
        total.impulse[a] += sums.impulse[a];
        sums.impulse[a] = 0;
      }
    }
    totals[collider] = total;
  }
};

/// The report of one part, in kReports pieces: a block makes each.
struct ReportLiquid {
  static constexpr int kThreads = 256;
  static constexpr Index kReports = 32;
  View<const Index> count;
  View<const Vec3f> x_m, v_m_s;
  View<const float> density_kg_m3;
  View<const LiquidCounters> counters;
  View<const EmitterState> emitters;
  float max_speed_m_s, inverse_density;
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
        r.fastest_m_s = max(r.fastest_m_s, speed);
        r.densest = max(r.densest, density_kg_m3[i] * inverse_density);
      }
      s.of[t] = r;
    });
    b.on_one_thread([&] {
      LiquidReport r = s.of[0];
      for (int t = 1; t < kThreads; ++t) r.add(s.of[t]);
      if (b.index() == 0) add_ledger(r);
      reports[b.index()] = r;
    });
  }

 private:
  TACTUS_HD void add_ledger(LiquidReport& r) const {
    r.placed = counters[0].placed;
    r.emitted = counters[0].emitted;
    r.taken = counters[0].taken;
    r.replaced = counters[0].replaced;
    for (Index k = 0; k < emitters.size(); ++k)
      r.waiting += static_cast<std::uint32_t>(emitters[k].waiting * emitters[k].points);
  }
};

}  // namespace tactus
