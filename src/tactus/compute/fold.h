#pragma once
/// Reduces the results of a block's threads to one.
#include "tactus/base/math.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// Entry 0 of shared memory takes all of the first `count` <= kCapacity entries, in halves: take(a, b) makes
/// entry a that of both. kCapacity is a power of two.
template <int kCapacity, class Block, class F>
TACTUS_HD void fold(const Block& b, int count, F&& take) {
  static_assert((kCapacity & (kCapacity - 1)) == 0);
  for (int half = kCapacity / 2; half > 0; half /= 2)
    b.for_threads(min(half, count - half), [&](int t) { take(t, t + half); });
}

}  // namespace tactus
