#pragma once
/// Reads and writes of 16 bytes at once.
#include <array>
#include <bit>

#include "tactus/compute/view.h"

namespace tactus {

/// As View::constant, for data that nobody writes while the kernel runs. T: 16 bytes, aligned so.
template <class T>
TACTUS_HD std::remove_const_t<T> load_constant(View<T> view, Index i) {
  static_assert(std::is_const_v<T>);
  static_assert(sizeof(T) == 16, "16 bytes");
  static_assert(alignof(T) == 16, "aligned to 16 bytes");
#if defined(__CUDA_ARCH__) && !defined(TACTUS_CHECKED)
  return std::bit_cast<std::remove_const_t<T>>(__ldg(reinterpret_cast<const uint4*>(view.data() + i)));
#else
  return view[i];
#endif
}

#if defined(__CUDA_ARCH__)
namespace detail {
template <class T>
using WideWords = std::array<uint4, sizeof(T) / 16>;
}
#endif

/// to = from. Threads that write large structs side by side would write them number by number, each to a
/// cache line of its own.
template <class T>
TACTUS_HD void store_wide(T& to, const T& from) {
  static_assert(sizeof(T) % 16 == 0 && alignof(T) == 16, "aligned to 16 bytes");
#if defined(__CUDA_ARCH__)
  const auto words = std::bit_cast<detail::WideWords<T>>(from);
  for (std::size_t w = 0; w < words.size(); ++w) reinterpret_cast<uint4*>(&to)[w] = words[w];
#else
  to = from;
#endif
}
/// A copy, likewise.
template <class T>
TACTUS_HD T load_wide(const T& from) {
  static_assert(sizeof(T) % 16 == 0 && alignof(T) == 16, "aligned to 16 bytes");
#if defined(__CUDA_ARCH__)
  detail::WideWords<T> words;
  for (std::size_t w = 0; w < words.size(); ++w) words[w] = reinterpret_cast<const uint4*>(&from)[w];
  return std::bit_cast<T>(words);
#else
  return from;
#endif
}

}  // namespace tactus
