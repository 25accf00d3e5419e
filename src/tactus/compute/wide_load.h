#pragma once
/// Reads of 16 bytes at once.
#include <bit>

#include "tactus/compute/view.h"

namespace tactus {

/// As View::constant: of what nobody writes while the kernel runs. T: 16 bytes, aligned so.
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

}  // namespace tactus
