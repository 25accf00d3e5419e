#pragma once
/// Reduces the results of a block's threads to one.
#include "tactus/base/math.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// Entry 0 of shared memory takes all of the first `count` <= kRoom entries, in halves: take(a, b) makes
/// entry a that of both. kRoom is a power of two.
template <int kRoom, class Block, class F>
TACTUS_HD void fold(const Block& b, int count, F&& take) {
  static_assert((kRoom & (kRoom - 1)) == 0);
  for (int half = kRoom / 2; half > 0; half /= 2)
    b.for_threads(min(half, count - half), [&](int t) { take(t, t + half); });
}

}  // namespace tactus
