#pragma once
/// Integer atomics for kernels. Integer maxima and sums do not depend on the order in which they come, so the
/// result is the same on every device; floating-point sums would not be, and there are none.
#include "tactus/base/hd.h"

namespace tactus {

TACTUS_HD inline void atomic_max(std::uint32_t& target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicMax(&target, value);
#else
  std::uint32_t seen = __atomic_load_n(&target, __ATOMIC_RELAXED);
  while (seen < value &&
         !__atomic_compare_exchange_n(&target, &seen, value, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
#endif
}
TACTUS_HD inline void atomic_add(std::uint32_t& target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicAdd(&target, value);
#else
  __atomic_fetch_add(&target, value, __ATOMIC_RELAXED);
#endif
}
/// Returns what was there: a place in a list whose order nothing depends on.
TACTUS_HD inline Index fetch_add(Index& target, Index value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(&target, value);
#else
  return __atomic_fetch_add(&target, value, __ATOMIC_RELAXED);
#endif
}
/// Wraps around, so packed signed fields may be added, too.
TACTUS_HD inline void atomic_add(std::uint64_t& target, std::uint64_t value) {
#if defined(__CUDA_ARCH__)
  static_assert(sizeof(unsigned long long) == sizeof(std::uint64_t));
  atomicAdd(reinterpret_cast<unsigned long long*>(&target), static_cast<unsigned long long>(value));
#else
  __atomic_fetch_add(&target, value, __ATOMIC_RELAXED);
#endif
}

}  // namespace tactus
