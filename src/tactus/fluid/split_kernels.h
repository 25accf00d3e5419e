#pragma once
/// Particles that go to another device, and copies of those near its slab. Lists are in any order: the search
/// sorts by ids, so no result depends on it.
#include <bit>
#include <cstring>

#include "tactus/compute/atomic.h"
#include "tactus/fluid/flow_kernels.h"
#include "tactus/fluid/liquid_slabs.h"
#include "tactus/geom/search/cell_hash.h"

namespace tactus {

/// Particles of a part by the digits of their ids, the highest first.
struct LiquidAges {
  static constexpr Index kDigits = 3, kMostBits = 11, kCounts = kDigits << kMostBits;
  TACTUS_HD static Index bits(Index digit) { return digit < 2 ? 10 : 11; }
  TACTUS_HD static Index shift(Index digit) { return digit == 0 ? 21 : (digit == 1 ? 11 : 0); }
};

/// Data of one part of a liquid that the others read. Every part has the views of all parts.
struct LiquidShown {
  View<Vec3f> x_m, v_m_s;
  View<float> push;
  View<Index> id;
  // Particles that others take over, listed for each of them:
  View<Index> export_count;  ///< (kMostLiquidParts)
  View<Index> export_list;   ///< (kMostLiquidParts or fewer, capacity) numbers of particles
  Index capacity = 0;
  View<const Index> slot_of;  ///< per number of a particle, in the order of the search
  View<const Index> own;      ///< (1) particles that aren't copies
  View<const std::uint32_t> ages;
  View<const WallSums> wall_totals;
  View<const LiquidReport> reports;  ///< (ReportLiquid::kReports)
  TACTUS_HD Index& listed(Index part, Index k) const { return export_list[part * capacity + k]; }
  TACTUS_HD void show_to(Index part, Index i) const {
    const auto k =
        static_cast<Index>(atomic_fetch_add(reinterpret_cast<std::uint32_t&>(export_count[part]), 1U));
    listed(part, k) = i;
  }
};

/// Where the original of a copy is.
struct LiquidOriginal {
  Index part = 0;
  Index at = 0;  ///< number of the particle, and once all have sorted theirs, its slot
};

/// Thread: particle. Those in another part's slab are listed for it.
struct ListLeavers {
  Index part;
  View<const LiquidSlabs> slabs;
  CellHash hash;
  LiquidShown own;
  TACTUS_HD void operator()(Index i) const {
    const Vec3f x = own.x_m[i];
    if (!hash.holds(x)) return;
    const Index owner = slabs[0].owner(x);
    if (owner != part) own.show_to(owner, i);
  }
};

/// Thread: particle. Those that others took over have no position any more; those near another part's slab
/// are listed for it.
struct ListGhosts {
  Index part;
  View<const LiquidSlabs> slabs;
  CellHash hash;
  float reach_m;
  LiquidShown own;
  TACTUS_HD void operator()(Index i) const {
    const Vec3f x = own.x_m[i];
    if (!hash.holds(x)) return;
    const LiquidSlabs& s = slabs[0];
    if (s.owner(x) != part) {
      const float nan = std::bit_cast<float>(0x7fc00000U);
      own.x_m[i] = {nan, nan, nan};
      return;
    }
    for (Index other = 0; other < s.parts; ++other)
      if (other != part && s.reaches(other, x, reach_m)) own.show_to(other, i);
  }
};

/// Particles that a part takes over from the others in one go.
struct LiquidImport {
  Index base = 0;                          ///< number of the first
  Index first[kMostLiquidParts + 1] = {};  ///< of those from each part
};

/// How many come, and where they go: behind those that are here. One thread.
struct PlanImport {
  Index part;
  View<const LiquidShown> shown;
  View<Index> count;     ///< particles here, then with those that come
  View<Index> imported;  ///< (1)
  View<LiquidImport> import;
  TACTUS_HD void operator()(Index) const {
    LiquidImport& made = import[0];
    Index sum = 0;
    for (Index other = 0; other < shown.size(); ++other) {
      made.first[other] = sum;
      if (other != part) sum += shown[other].export_count[part];
    }
    made.first[shown.size()] = sum;
    made.base = count[0];
    imported[0] = sum;
    count[0] += sum;
  }
};

/// Thread: particle that comes.
struct TakeOver {
  Index part;
  View<const LiquidShown> shown;
  View<const LiquidImport> import;
  View<LiquidOriginal> originals;  ///< empty: not kept
  TACTUS_HD void operator()(Index k) const {
    const LiquidImport& plan = import[0];
    Index other = 0;
    while (k >= plan.first[other + 1]) ++other;
    const LiquidShown &from = shown[other], &to = shown[part];
    const Index i = from.listed(part, k - plan.first[other]), here = plan.base + k;
    to.x_m[here] = from.x_m[i];
    to.v_m_s[here] = from.v_m_s[i];
    to.push[here] = from.push[i];
    to.id[here] = from.id[i];
    if (!originals.empty()) originals[k] = {other, i};
  }
};

/// Thread: slot.
struct InvertOrder {
  View<const Index> order;
  View<Index> slot_of;
  TACTUS_HD void operator()(Index slot) const { slot_of[order[slot]] = slot; }
};

/// Thread: copy. Its slot and that of its original; it is no particle of the next step.
struct FindOriginals {
  View<const LiquidShown> shown;
  View<const LiquidImport> import;
  View<const Index> slot_of;
  View<LiquidOriginal> originals;
  View<Index> ghost_slot;
  View<Vec3f> x_m;
  TACTUS_HD void operator()(Index k) const {
    const Index here = slot_of[import[0].base + k];
    const LiquidOriginal from = originals[k];
    originals[k].at = shown[from.part].slot_of[from.at];
    ghost_slot[k] = here;
    const float nan = std::bit_cast<float>(0x7fc00000U);
    x_m[here] = {nan, nan, nan};
  }
};

/// Thread: copy. It gets the value of its original.
template <class T>
struct PullGhosts {
  View<const LiquidOriginal> originals;
  View<const Index> ghost_slot;
  View<const T> from[kMostLiquidParts];
  View<T> to;
  TACTUS_HD void operator()(Index k) const {
    const LiquidOriginal original = originals[k];
    to[ghost_slot[k]] = from[original.part][original.at];
  }
};

/// Copies that are stale, on virtual devices.
template <class T>
struct PoisonGhosts {
  View<const Index> ghost_slot;
  View<T> to;
  TACTUS_HD void operator()(Index k) const {
    std::memset(static_cast<void*>(&to[ghost_slot[k]]), 0xFF, sizeof(T));
  }
};

/// Thread: particle. Those that are here, by layers.
struct CountLayers {
  LiquidLayers layers;
  View<const Vec3f> x_m;
  View<Index> counts;  ///< (LiquidLayers::kCounts)
  TACTUS_HD void operator()(Index i) const {
    const Vec3f x = x_m[i];
    if (!(abs(x.x) < 1e9F)) return;
    for (Index axis = 0; axis < 3; ++axis)
      atomic_add(reinterpret_cast<std::uint32_t&>(counts[layers.at(x, axis)]), 1U);
  }
};

/// Merges the reports of all parts and their impulses on walls. Thread: owner of walls.
struct MergeParts {
  View<const LiquidShown> shown;
  float unit_N_s;  ///< of WallSums
  View<Vec3f> impulse_N_s;
  View<LiquidReport> report;
  TACTUS_HD void operator()(Index owner) const {
    WallSums total{};
    for (Index part = 0; part < shown.size(); ++part) {
      for (int a = 0; a < 3; ++a) total.impulse[a] += shown[part].wall_totals[owner].impulse[a];
    }
    impulse_N_s[owner] = total.value(unit_N_s);
    if (owner != 0) return;
    LiquidReport all;
    for (Index part = 0; part < shown.size(); ++part) {
      for (Index k = 0; k < ReportLiquid::kReports; ++k) all.add(shown[part].reports[k]);
    }
    report[0] = all;
  }
};

}  // namespace tactus
