#pragma once
/// Integer atomics for kernels. Integer maxima, minima and sums do not depend on the order in which they
/// come, so the result is the same on every device; floating-point sums would not be, and there are none.
/// A kernel that uses an atomic's return value has to say why its result doesn't depend on the order.
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
TACTUS_HD inline void atomic_min(std::uint32_t& target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  atomicMin(&target, value);
#else
  std::uint32_t seen = __atomic_load_n(&target, __ATOMIC_RELAXED);
  while (value < seen &&
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
TACTUS_HD inline void atomic_or(std::uint32_t& target, std::uint32_t bits) {
#if defined(__CUDA_ARCH__)
  atomicOr(&target, bits);
#else
  __atomic_fetch_or(&target, bits, __ATOMIC_RELAXED);
#endif
}
/// Returns the value before: which of several callers sees which value depends on the order.
TACTUS_HD inline std::uint32_t atomic_fetch_add(std::uint32_t& target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicAdd(&target, value);
#else
  return __atomic_fetch_add(&target, value, __ATOMIC_RELAXED);
#endif
}
/// Likewise.
TACTUS_HD inline std::uint32_t atomic_exchange(std::uint32_t& target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicExch(&target, value);
#else
  return __atomic_exchange_n(&target, value, __ATOMIC_RELAXED);
#endif
}
TACTUS_HD inline std::uint32_t atomic_load(const std::uint32_t& source) {
#if defined(__CUDA_ARCH__)
  return *static_cast<const volatile std::uint32_t*>(&source);
#else
  return __atomic_load_n(&source, __ATOMIC_RELAXED);
#endif
}
TACTUS_HD inline void atomic_store(std::uint32_t& target, std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  *static_cast<volatile std::uint32_t*>(&target) = value;
#else
  __atomic_store_n(&target, value, __ATOMIC_RELAXED);
#endif
}
/// Replaces `expected`, and nothing else, by `value`. Returns the value before.
TACTUS_HD inline std::uint32_t atomic_replace(std::uint32_t& target, std::uint32_t expected,
                                              std::uint32_t value) {
#if defined(__CUDA_ARCH__)
  return atomicCAS(&target, expected, value);
#else
  __atomic_compare_exchange_n(&target, &expected, value, false, __ATOMIC_RELAXED, __ATOMIC_RELAXED);
  return expected;
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
