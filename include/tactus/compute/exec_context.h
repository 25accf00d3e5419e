#pragma once
/// Where work is submitted: a device and one in-order stream on it. Everything is asynchronous until
/// `synchronize`.
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "tactus/base/timing.h"
#include "tactus/compute/buffer.h"
#include "tactus/compute/cpu_for.h"
#include "tactus/compute/kernel.h"

namespace tactus {

class ExecContext;

namespace detail {
/// Defined by TACTUS_CUDA_KERNEL in a folder's kernels.cu and nowhere else: a kernel that is not listed there
/// is a link error that names it. Size and alignment are part of the name, so both compilers agree on the
/// layout.
template <class K, std::size_t kSize, std::size_t kAlign>
void launch_cuda(void* cuda_stream, const char* name, Count count, const K& kernel);

template <class K>
constexpr Index grain_of() {
  if constexpr (requires { K::kGrain; })
    return K::kGrain;
  else if constexpr (BlockKernel<K>)
    return 1;
  else
    return 2048;
}

/// K::LoopShared where there is one, else K::Shared.
template <class K>
struct SharedOnCpu {
  using Type = typename K::Shared;
};
template <class K>
requires requires { typename K::LoopShared; }
struct SharedOnCpu<K> {
  using Type = typename K::LoopShared;
};

template <class K>
void run_on_cpu(Count count, const K& kernel) {
  cpu_for_ranges(
      count.get(), grain_of<K>(),
      [](void* data, Index first, Index last) {
        K k = *static_cast<const K*>(data);  // a local copy: lets the compiler keep pointers in registers
        if constexpr (LoadingKernel<K>) k.load();
        if constexpr (BlockKernel<K>) {
          typename SharedOnCpu<K>::Type shared;
          for (Index i = first; i < last; ++i) k(CpuBlock<K::kThreads>(i), shared);
        } else {
#pragma omp simd
          for (Index i = first; i < last; ++i) k(i);
        }
      },
      const_cast<K*>(&kernel));
}
}  // namespace detail

/// A point in a context's stream that other contexts can wait for.
class Event {
 public:
  Event();
  ~Event();
  Event(Event&&) noexcept;
  Event& operator=(Event&&) noexcept;
  struct Impl;
  Impl& impl() { return *impl_; }
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// A recorded sequence of submissions that is launched as one. Pointers and sizes are frozen; contents are
/// not.
class Graph {
 public:
  Graph();
  ~Graph();
  Graph(Graph&&) noexcept;
  Graph& operator=(Graph&&) noexcept;
  struct Impl;
  Impl& impl() { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

class ExecContext {
 public:
  explicit ExecContext(Device& device);
  ~ExecContext();
  ExecContext(const ExecContext&) = delete;
  ExecContext& operator=(const ExecContext&) = delete;

  Device& device() const { return device_; }

  /// kernel(i) for every i in [0, count), or one block per i for block kernels. `name` shows in profiles and
  /// errors.
  template <class K>
  void parallel_for(const char* name, Count count, const K& kernel) {
    if (count.capacity <= 0) return;
    const KernelTimer timer(*this, name);
#if defined(TACTUS_WITH_CUDA)
    if (device_.is_cuda()) {
      detail::launch_cuda<K, sizeof(K), alignof(K)>(stream_, name, count, kernel);
      return;
    }
#endif
    if (defers())
      submit(name, [count, kernel] { detail::run_on_cpu(count, kernel); });
    else
      detail::run_on_cpu(count, kernel);
  }

  /// out[i] = in[0] + ... + in[i-1]. Both hold n values; make the last input a 0 to get the total in the last
  /// output. May run in place.
  void exclusive_scan(const char* name, View<const Index> in, View<Index> out);
  /// Likewise of the first `count` only; the outputs behind them are undefined.
  void exclusive_scan(const char* name, Count count, View<const Index> in, View<Index> out);
  /// Likewise for words, modulo 2^64: several counts packed in one, for instance.
  void exclusive_scan(const char* name, View<const std::uint64_t> in, View<std::uint64_t> out);
  /// Indices i with flags[i] != 0, ascending, to `out`; their number to `out_count` (1). `out` holds as many
  /// as flags.
  void compact(const char* name, View<const Index> flags, View<Index> out, View<Index> out_count) {
    compact(name, flags.size(), flags, out, out_count);
  }
  /// Likewise of the first `count` flags only.
  void compact(const char* name, Count count, View<const Index> flags, View<Index> out,
               View<Index> out_count);
  /// Sorts keys with their values, stable. The scratch views (as long as the keys) take the other half of the
  /// passes.
  void sort_pairs(const char* name, View<std::uint32_t> keys, View<Index> values,
                  View<std::uint32_t> keys_scratch, View<Index> values_scratch, int key_bits = 32) {
    sort_pairs(name, keys.size(), keys, values, keys_scratch, values_scratch, key_bits);
  }
  /// Likewise of the first `count` pairs. A GPU, which learns the count too late, sorts them all: there the
  /// keys behind must not be below any before. On a CPU, the pairs behind them are undefined.
  void sort_pairs(const char* name, Count count, View<std::uint32_t> keys, View<Index> values,
                  View<std::uint32_t> keys_scratch, View<Index> values_scratch, int key_bits = 32);
  /// out[0] = sum of in, by one fixed tree over indices: the same bits on every device. `scratch`:
  /// in.size()/256 + 2.
  void sum(const char* name, View<const float> in, View<float> out, View<float> scratch);

  /// Copies between memories. Host spans must stay valid and unchanged until `synchronize`.
  template <class T>
  void upload(std::span<const std::type_identity_t<T>> from, View<T> to) {
    check_copy(from.size(), to.size());
    copy_bytes(to.data(), from.data(), from.size_bytes(), CopyKind::upload);
  }
  template <class T>
  void download(View<const T> from, std::span<std::type_identity_t<T>> to) {
    check_copy(static_cast<std::size_t>(from.size()), static_cast<Index>(to.size()));
    copy_bytes(to.data(), from.data(), to.size_bytes(), CopyKind::download);
  }
  /// Same device, or a peer's memory.
  template <class T>
  void copy(View<const T> from, View<T> to) {
    check_copy(static_cast<std::size_t>(from.size()), to.size());
    copy_bytes(to.data(), from.data(), sizeof(T) * static_cast<std::size_t>(from.size()), CopyKind::device);
  }
  /// Sets every byte.
  template <class T>
  void fill_bytes(View<T> what, std::uint8_t byte) {
    fill(what.data(), byte, sizeof(T) * static_cast<std::size_t>(what.size()));
  }

  void record(Event& event);
  void wait(const Event& event);
  /// Waits until everything submitted so far is done. @throws Error on a device failure.
  void synchronize();
  /// Waits until this context has done all work submitted to it before it last recorded the event. Returns at
  /// once when the event was never recorded.
  void synchronize(const Event& event);

  /// Records the work that `body` submits to this context; nothing runs. Run the body once before (scratch is
  /// sized then).
  Graph capture(const std::function<void()>& body);
  void launch(Graph& graph);
  /// Whether `capture` of this context is recording the work submitted now.
  bool is_recording() const { return capturing_; }
  /// Runs `work` when the queue comes to it. Not on a GPU.
  void on_host(const char* name, std::function<void()> work) { submit(name, std::move(work)); }

  /// Takes the memory that exclusive_scan, compact and sort_pairs of up to n need on a GPU. For one whose
  /// first run may be a recording.
  void reserve_scratch(Index n);
  /// Memory for the library's own algorithms, at least `bytes`; grows only outside frames.
  void* scratch(std::size_t bytes);
  void* cuda_stream() const { return stream_; }
  /// From now on every kernel and algorithm is waited for and timed under its name; nullptr: no longer.
  void profile(Timings* timings) { profile_ = timings; }
  bool is_profiling() const { return profile_ != nullptr; }

 private:
  /// Times one submission when profiling.
  class KernelTimer {
   public:
    KernelTimer(ExecContext& ctx, const char* name)
        : ctx_(ctx), name_(name), begin_s_(ctx.profile_ != nullptr ? now_s() : 0) {}
    ~KernelTimer() {
      if (ctx_.profile_ != nullptr) ctx_.finish_profiled(name_, begin_s_);
    }
    KernelTimer(const KernelTimer&) = delete;
    KernelTimer& operator=(const KernelTimer&) = delete;

   private:
    ExecContext& ctx_;
    const char* name_;
    double begin_s_;
  };
  void finish_profiled(const char* name, double begin_s) noexcept;
  enum class CopyKind : std::uint8_t { upload, download, device };
  static void check_copy(std::size_t from, Index to);
  static void check_capacity(const Count& count, Index capacity);
  void copy_bytes(void* to, const void* from, std::size_t bytes, CopyKind kind);
  void fill(void* what, std::uint8_t byte, std::size_t bytes);
  bool defers() const { return queue_ >= 0 || recording_ != nullptr; }
  void submit(const char* name, std::function<void()> work);

  Device& device_;
  void* stream_ = nullptr;  ///< cudaStream_t on CUDA
  int queue_ = -1;          ///< queue of the virtual scheduler
  std::vector<std::function<void()>>* recording_ = nullptr;
  std::vector<Buffer<std::uint8_t>>
      scratch_;  ///< the last one is in use; graphs may still hold the ones before
  Timings* profile_ = nullptr;
  bool capturing_ = false;
};

/// Copies a view to a vector: for tests, exporters, the ends of a frame. Synchronizes.
template <class T>
std::vector<std::remove_const_t<T>> to_host(ExecContext& ctx, View<T> view) {
  std::vector<std::remove_const_t<T>> out(static_cast<std::size_t>(view.size()));
  ctx.download(View<const std::remove_const_t<T>>(view), std::span<std::remove_const_t<T>>(out));
  ctx.synchronize();
  return out;
}
/// A buffer with these contents. Synchronizes.
template <class T>
Buffer<T> to_device(ExecContext& ctx, std::span<const T> values) {
  Buffer<T> buffer(ctx.device(), static_cast<std::int64_t>(values.size()));
  ctx.upload(values, buffer.view());
  ctx.synchronize();
  return buffer;
}
template <class T>
Buffer<T> to_device(ExecContext& ctx, const std::vector<T>& values) {
  return to_device(ctx, std::span<const T>(values));
}

/// A stage that is recorded on its second run and replayed from then on (GPU only; others just run).
class Replay {
 public:
  void run(ExecContext& ctx, const std::function<void()>& stage) {
    if (!ctx.device().is_cuda() || ctx.is_profiling() || runs_++ == 0) return stage();
    if (!graph_) graph_ = ctx.capture(stage);
    ctx.launch(*graph_);
  }

 private:
  int runs_ = 0;
  std::optional<Graph> graph_;
};

/// The same for a stage whose launches depend on `key`: when that changes, the recording begins anew.
template <class Key>
class KeyedReplay {
 public:
  void run(ExecContext& ctx, const Key& key, const std::function<void()>& stage) {
    if (!(key == key_)) replay_ = {};
    key_ = key;
    replay_.run(ctx, stage);
  }

 private:
  Key key_{};
  Replay replay_;
};

}  // namespace tactus
