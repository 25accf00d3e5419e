#pragma once
/// Exclusive sums of as many numbers as the device says, in two launches: tiles that it does not need end at
/// once, so the time follows the count and not the capacity.
#include "tactus/compute/fold.h"

namespace tactus {

inline constexpr Index kScanTile = 2048;

/// Sum of the numbers of a tile.
struct SumTile {
  static constexpr int kThreads = 256;
  struct Shared {
    Index sum[kThreads];
  };
  Count count;
  View<const Index> values;
  View<Index> tile_sum;
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index tile = b.index(), first = tile * kScanTile, n = min(count.get() - first, kScanTile);
    if (n <= 0) return;
    b.for_each_thread([&](int t) {
      Index sum = 0;
      for (Index i = t; i < n; i += kThreads) sum += values[first + i];
      s.sum[t] = sum;
    });
    fold<kThreads>(b, kThreads, [&](int t, int other) { s.sum[t] += s.sum[other]; });
    b.for_threads(1, [&](int) { tile_sum[tile] = s.sum[0]; });
  }
};

/// Numbers become the sums of those before them, in place. Behind the last stands the sum of all.
struct ScanTile {
  static constexpr int kThreads = 256, kEach = kScanTile / kThreads;
  struct Shared {
    Index value[kScanTile + kThreads];  ///< one place more after every kEach: no bank conflicts
    Index sum[2][kThreads];
    Index before[kThreads];
  };
  Count count;
  View<const Index> tile_sum;
  View<Index> values;  ///< (capacity + 1)
  View<Index> total;   ///< (1)
  template <class Block>
  TACTUS_HD void operator()(const Block& b, Shared& s) const {
    const Index tile = b.index(), first = tile * kScanTile, n = min(count.get() - first, kScanTile);
    if (n <= 0) {
      b.for_threads(1, [&](int) {
        if (first == 0) values[0] = total[0] = 0;
      });
      return;
    }
    b.for_each_thread([&](int t) {
      Index sum = 0;
      for (Index before = t; before < tile; before += kThreads) sum += tile_sum[before];
      s.before[t] = sum;
    });
    b.for_range(kScanTile, [&](int i) { s.value[i + i / kEach] = i < n ? values[first + i] : 0; });
    fold<kThreads>(b, kThreads, [&](int t, int other) { s.before[t] += s.before[other]; });
    const int all = scan(b, s);
    b.for_range(n, [&](int i) { values[first + i] = s.value[i + i / kEach]; });
    b.for_threads(1, [&](int) {
      if (first + n == count.get()) total[0] = values[first + n] = s.before[0] + s.sum[all][kThreads - 1];
    });
  }

 private:
  /// @returns where the sums over threads are
  template <class Block>
  TACTUS_HD int scan(const Block& b, Shared& s) const {
    b.for_each_thread([&](int t) {
      Index sum = 0;
      for (int i = 0; i < kEach; ++i) sum += s.value[t * (kEach + 1) + i];
      s.sum[0][t] = sum;
    });
    int now = 0;
    for (int step = 1; step < kThreads; step *= 2, now = 1 - now) {
      b.for_each_thread(
          [&](int t) { s.sum[1 - now][t] = s.sum[now][t] + (t >= step ? s.sum[now][t - step] : 0); });
    }
    b.for_each_thread([&](int t) {
      Index running = s.before[0] + (t > 0 ? s.sum[now][t - 1] : 0);
      for (int i = 0; i < kEach; ++i) {
        Index& place = s.value[t * (kEach + 1) + i];
        const Index value = place;
        place = running;
        running += value;
      }
    });
    return now;
  }
};

}  // namespace tactus
