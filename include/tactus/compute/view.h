#pragma once
/// A typed window on device memory, for kernels. Never owns. `View<const T>` for reading.
#if defined(__CUDACC__)
#include <cstdio>
#endif
#include <type_traits>

#include "tactus/base/hd.h"

namespace tactus {

/// Ends a checked build's kernel with a message that names the index and the extent.
[[noreturn]] void fail_view_check(Index index, Index extent);

template <class T>
class View {
 public:
  using value_type = T;
  constexpr View() = default;
  TACTUS_HD constexpr View(T* data, Index size) : data_(data), size_(size) {}
  /// A view for writing is also one for reading.
  template <class U>
  requires std::is_same_v<const U, T> TACTUS_HD constexpr View(View<U> other)
      : data_(other.data()), size_(other.size()) {}

  TACTUS_HD constexpr T& operator[](Index i) const {
#if defined(TACTUS_CHECKED)
    check(i);
#endif
    return data_[i];
  }
  /// Element i of data that nobody writes while the kernel runs: a GPU may read it ahead of anything written
  /// before.
  TACTUS_HD constexpr std::remove_const_t<T> constant(Index i) const requires std::is_const_v<T> {
#if defined(__CUDA_ARCH__) && !defined(TACTUS_CHECKED)
    return __ldg(data_ + i);
#else
    return (*this)[i];
#endif
  }
  TACTUS_HD constexpr T* data() const { return data_; }
  TACTUS_HD constexpr Index size() const { return size_; }
  TACTUS_HD constexpr bool empty() const { return size_ == 0; }
  TACTUS_HD constexpr View part(Index begin, Index count) const { return {data_ + begin, count}; }

 private:
#if defined(TACTUS_CHECKED)
  TACTUS_HD constexpr void check(Index i) const {
    if (i >= 0 && i < size_) return;
#if defined(__CUDA_ARCH__)
    printf("view check failed: index %d, extent %d\n", i, size_);
    __trap();
#else
    fail_view_check(i, size_);
#endif
  }
#endif
  T* data_ = nullptr;
  Index size_ = 0;
};

}  // namespace tactus
