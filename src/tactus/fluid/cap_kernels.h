#pragma once
/// The cap of particles: where newer ones need their room, the oldest leave.
#include <bit>

#include "tactus/fluid/split_kernels.h"

namespace tactus {

/// Finds the id up to which particles leave so that `max_particles` are left, digit by digit (radix
/// selection: ids grow with time, so the smallest are the oldest). Four launches, levels 0 to kLevels; all
/// parts end one before the next begins. Level k counts particles by digit k of those ids that begin with the
/// digits found before; every block looks these up again in the counts of all parts. In level kLevels,
/// particles leave: they have no position any more. While nobody needs room, a launch reads one number.
struct KeepYoungest {
  static constexpr int kThreads = 256, kLevels = 3;
  static constexpr Index kBlocks = 32, kBins = 1 << LiquidAges::kMostBits;
  Index level, max_particles;
  View<const LiquidShown> shown;
  View<const Index> count;  ///< particles given, with those that came
  View<const Index> id;
  View<Vec3f> x_m;
  View<std::uint32_t> ages;      ///< (LiquidAges::kCounts) zero before level 0
  View<std::uint32_t> replaced;  ///< (1)

  struct Shared {
    std::uint32_t of_bin[kBins];
    Index of_thread[kThreads];
    Index
        rank;  ///< the id sought is the rank-th of those that begin with `prefix`, from 1 on; 0: none leaves
    Index prefix;
  };
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    b.on_one_thread([&] {
      s.rank = used() > max_particles ? 1 : 0;
      s.prefix = 0;
    });
    for (Index k = 0; k < level && s.rank > 0; ++k) choose(b, s, k);
    if (s.rank == 0) return;
    if (level < kLevels)
      count_ages(b, s);
    else
      leave(b, s);
  }

 private:
  /// With those that left in the last step: there are no more than that.
  TACTUS_HD Index used() const {
    if (shown.size() == 1) return count[0];
    Index all = 0;
    for (Index part = 0; part < shown.size(); ++part) all += shown[part].own[0];
    return all;
  }
  TACTUS_HD bool is_here(Index i) const { return abs(x_m[i].x) < 1e9F; }

  /// Digit k of the id.
  template <class Block>
  TACTUS_HD void choose(const Block& b, Shared& s, Index k) const {
    constexpr Index kEach = kBins / kThreads;
    b.for_each_thread([&](int t) {
      Index own = 0;
      for (Index bin = t * kEach; bin < (t + 1) * kEach; ++bin) {
        std::uint32_t sum = 0;
        for (Index part = 0; part < shown.size(); ++part) sum += shown[part].ages[k * kBins + bin];
        s.of_bin[bin] = sum;
        own += static_cast<Index>(sum);
      }
      s.of_thread[t] = own;
    });
    b.on_one_thread([&] {
      if (k == 0) {
        Index here = 0;
        for (const Index own : s.of_thread) here += own;
        s.rank = max(here - max_particles, Index{0});
        if (s.rank == 0) return;
      }
      Index bin = 0;
      for (int t = 0; t + 1 < kThreads && s.rank > s.of_thread[t]; ++t) {
        s.rank -= s.of_thread[t];
        bin += kEach;
      }
      for (; bin + 1 < kBins && s.rank > static_cast<Index>(s.of_bin[bin]); ++bin)
        s.rank -= static_cast<Index>(s.of_bin[bin]);
      s.prefix = (s.prefix << LiquidAges::bits(k)) + bin;
    });
  }

  template <class Block>
  TACTUS_HD void count_ages(const Block& b, Shared& s) const {
    const Index shift = LiquidAges::shift(level), mask = (1 << LiquidAges::bits(level)) - 1;
    b.for_each_thread([&](int t) {
      for (Index bin = t; bin < kBins; bin += kThreads) s.of_bin[bin] = 0;
    });
    b.for_each_thread([&](int t) {
      for (Index i = b.index() * kThreads + t; i < count[0]; i += kBlocks * kThreads) {
        if (is_here(i) && id[i] >> shift >> LiquidAges::bits(level) == s.prefix)
          atomic_add(s.of_bin[id[i] >> shift & mask], 1U);
      }
    });
    b.for_each_thread([&](int t) {
      for (Index bin = t; bin < kBins; bin += kThreads)
        if (s.of_bin[bin] > 0) atomic_add(ages[level * kBins + bin], s.of_bin[bin]);
    });
  }

  template <class Block>
  TACTUS_HD void leave(const Block& b, Shared& s) const {
    const float nan = std::bit_cast<float>(0x7fc00000U);
    b.for_each_thread([&](int t) {
      for (Index i = b.index() * kThreads + t; i < count[0]; i += kBlocks * kThreads) {
        if (!is_here(i) || id[i] > s.prefix) continue;
        x_m[i] = {nan, nan, nan};
        atomic_add(replaced[0], 1U);
      }
    });
  }
};

}  // namespace tactus
