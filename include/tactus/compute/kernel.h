#pragma once
/// Kernels. There are two kinds, both plain structs with a call operator, written once for every device:
///
///   struct Scale {                       // "for" kernel: one call per index, in any order
///     View<float> x;
///     float factor;
///     TACTUS_HD void operator()(Index i) const { x[i] *= factor; }
///   };
///
///   struct RowSum {                      // "block" kernel: kThreads threads that share memory
///     static constexpr int kThreads = 64;
///     struct Shared { float partial[64]; };
///     template <class Block> TACTUS_HD void operator()(const Block& b, Shared& s) const {
///       b.for_each_thread([&](int t) { s.partial[t] = ...; });   // barrier after each
///       b.for_each_thread([&](int t) { ... });
///     }
///   };
///
/// Block offers: `b.index()`, `b.for_each_thread(f)` (all threads must reach it) and, for values kept between
/// two phases, `typename Block::template PerThread<T>`. Kernel headers hold maths only; the folder's
/// kernels.cu lists the structs so that nvcc makes them, too.
///
/// A block kernel may have `LoopShared`. A CPU gives it that in place of Shared, and keeps it from one block
/// to the next of a range of indices: data that neighbours have in common are made once.
///
/// A kernel may have `TACTUS_HD void load()`. It is called on a copy of the kernel before the call operator,
/// once a thread on a GPU (once a block, if it names `kLoadsTogether`) and once a range of indices on a CPU:
/// there the kernel reads numbers that change between launches of a recording (frame/frame_params.h) into its
/// members.
#include "tactus/compute/view.h"

namespace tactus {

/// `Shared` of a block kernel whose threads keep to themselves: the kernel uses only index(), for_each_thread
/// and PerThread of Block, and kThreads divides 128. A GPU works on several such blocks side by side.
struct NoShared {};

/// How many indices a launch covers: known to the host, or read on the device, at most `capacity`.
struct Count {
  Index capacity = 0;
  const Index* device_count = nullptr;  ///< device memory; nullptr: exactly `capacity`
  TACTUS_HD constexpr Count(Index n)
      : capacity(n) {}  // NOLINT: implicit on purpose, parallel_for(name, n, ...)
  TACTUS_HD constexpr Count(View<const Index> count, Index cap) : capacity(cap), device_count(count.data()) {}
  TACTUS_HD constexpr Index get() const {
    return device_count == nullptr ? capacity : (*device_count < capacity ? *device_count : capacity);
  }
};

/// One block on the CPU: its threads are the lanes of a loop.
template <int kThreads>
class CpuBlock {
 public:
  static constexpr bool kIsLoop = true;  ///< threads are the lanes of a loop: work that all need is done once
  template <class T>
  struct PerThread {
    static constexpr int kBefore = sizeof(T) < 64 ? 64 / sizeof(T) : 1;  ///< so that value[-1] may be read
    T value[kBefore + kThreads];
    T& operator[](int t) { return value[kBefore + t]; }
    const T& operator[](int t) const { return value[kBefore + t]; }
  };
  explicit CpuBlock(Index index) : index_(index) {}
  Index index() const { return index_; }
  template <class F>
  void for_each_thread(F&& f) const {
#pragma omp simd
    for (int t = 0; t < kThreads; ++t) f(t);
  }
  template <class F>
  void for_threads(int count, F&& f) const {
#pragma omp simd
    for (int t = 0; t < count; ++t) f(t);
  }
  /// f(i) for i = 0 .. count-1, however many.
  template <class F>
  void for_range(int count, F&& f) const {
    for_threads(count, f);
  }
  /// Likewise, where f is long and a GPU's thread has few: its code is there once.
  template <class F>
  void for_few(int count, F&& f) const {
    for_threads(count, f);
  }
  /// As for_threads, for work on each thread's own data: no barrier follows, so a GPU may run ahead.
  template <class F>
  void for_own(int count, F&& f) const {
    for_threads(count, f);
  }
  /// All threads in groups of kGroup, f(g, t in 0 .. kGroup-1) for g = 0 .. count-1 where select(g), on each
  /// thread's own data, as for_own. count * kGroup <= kThreads.
  template <int kGroup, class S, class F>
  void for_own_groups(int count, S&& select, F&& f) const {
    for (int g = 0; g < count; ++g) {
      if (!select(g)) continue;
#pragma omp simd
      for (int t = 0; t < kGroup; ++t) f(g, t);
    }
  }
  /// Groups of kGroup threads work on g = 0 .. count-1 where select(g): f(g, t in 0 .. kGroup-1).
  template <int kGroup, class S, class F>
  void for_groups(int count, S&& select, F&& f) const {
    for (int g = 0; g < count; ++g) {
      if (!select(g)) continue;
#pragma omp simd
      for (int t = 0; t < kGroup; ++t) f(g, t);
    }
  }
  /// Writes the t in 0 .. count-1 (count <= kThreads) with chosen(t) to out, ascending, and their number to
  /// out_count; all three in shared memory.
  template <class P>
  void compact(int count, P&& chosen, int* out, int* out_count) const {
    int n = 0;
    for (int t = 0; t < count; ++t) {
      out[n] = t;
      n += chosen(t) ? 1 : 0;
    }
    *out_count = n;
  }
  /// Gives each thread the value of the one before: previous(v)[t] = v[t - 1]. For the first of every row of
  /// 32 threads it may be anything. All threads must reach it.
  template <class T>
  auto previous(const PerThread<T>& values) const {
    struct Previous {
      const T* value = nullptr;
      const T& operator[](int t) const { return value[t]; }
    };
    return Previous{values.value + PerThread<T>::kBefore - 1};
  }
  /// All threads have come here before any goes on.
  void barrier() const {}
  template <class F>
  void on_one_thread(F&& f) const {
    f();
  }

 private:
  Index index_;
};

template <class K>
concept ForKernel = requires(const K k, Index i) {
  k(i);
};
template <class K>
concept LoadingKernel = requires(K k) {
  k.load();
};
template <class K>
concept BlockKernel = requires {
  K::kThreads;
  typename K::Shared;
};

}  // namespace tactus
