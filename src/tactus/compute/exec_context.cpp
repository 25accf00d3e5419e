#include "tactus/compute/exec_context.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "tactus/base/math.h"
#include "tactus/compute/cuda/cuda_backend.h"
#include "tactus/compute/host_kernel.h"
#include "tactus/compute/sum_kernels.h"
#include "tactus/compute/virtual_scheduler.h"

namespace tactus {
namespace {

constexpr Index kScanPiece = 1 << 14;

template <class T>
void scan_on_cpu(View<const T> in, View<T> out) {
  const Index n = in.size();
  const Index pieces = ceil_div(n, kScanPiece);
  std::vector<T> piece_sum(static_cast<std::size_t>(pieces));
  const auto each_piece = [&](auto&& body) {
    detail::cpu_for_ranges(
        pieces, 1,
        [](void* data, Index first, Index last) {
          for (Index p = first; p < last; ++p)
            (*static_cast<std::remove_reference_t<decltype(body)>*>(data))(p);
        },
        &body);
  };
  if (pieces > 1) {
    each_piece([&](Index p) {
      T sum = 0;
      for (Index i = p * kScanPiece, end = std::min(n, i + kScanPiece); i < end; ++i) sum += in[i];
      piece_sum[static_cast<std::size_t>(p)] = sum;
    });
    T running = 0;
    for (T& sum : piece_sum) running += std::exchange(sum, running);
  }
  each_piece([&](Index p) {
    T running = piece_sum[static_cast<std::size_t>(p)];
    for (Index i = p * kScanPiece, end = std::min(n, i + kScanPiece); i < end; ++i) {
      const T value = in[i];
      out[i] = running;
      running += value;
    }
  });
}

void compact_on_cpu(Index count, View<const Index> flags, View<Index> out, View<Index> out_count) {
  Index chosen = 0;
  for (Index i = 0; i < count; ++i) {
    if (flags[i] != 0) out[chosen++] = i;
  }
  out_count[0] = chosen;
}

/// Stable least-significant-digit radix sort, 8 bits a pass.
void sort_on_cpu(Index n, View<std::uint32_t> keys, View<Index> values, View<std::uint32_t> keys2,
                 View<Index> values2, int bits) {
  int passes = 0;
  for (int shift = 0; shift < bits; shift += 8, ++passes) {
    std::array<Index, 256> start{};
    for (Index i = 0; i < n; ++i) ++start[(keys[i] >> shift) & 255U];
    Index running = 0;
    for (Index& s : start) running += std::exchange(s, running);
    for (Index i = 0; i < n; ++i) {
      const Index to = start[(keys[i] >> shift) & 255U]++;
      keys2[to] = keys[i];
      values2[to] = values[i];
    }
    std::swap(keys, keys2);
    std::swap(values, values2);
  }
  if (passes % 2 != 0) {  // the result stands in the caller's scratch
    std::copy_n(keys.data(), n, keys2.data());
    std::copy_n(values.data(), n, values2.data());
  }
}

}  // namespace

struct Event::Impl {
  std::shared_ptr<VirtualScheduler::Flag> flag = std::make_shared<VirtualScheduler::Flag>();
  void* cuda_event = nullptr;
  ~Impl() {
    if (cuda_event != nullptr) cuda::destroy_event(cuda_event);
  }
};
Event::Event() : impl_(std::make_unique<Impl>()) {}
Event::~Event() = default;
Event::Event(Event&&) noexcept = default;
Event& Event::operator=(Event&&) noexcept = default;

struct Graph::Impl {
  std::vector<std::function<void()>> steps;
  void* cuda_graph = nullptr;
  ~Impl() {
    if (cuda_graph != nullptr) cuda::destroy_graph(cuda_graph);
  }
};
Graph::Graph() : impl_(std::make_unique<Impl>()) {}
Graph::~Graph() = default;
Graph::Graph(Graph&&) noexcept = default;
Graph& Graph::operator=(Graph&&) noexcept = default;

ExecContext::ExecContext(Device& device) : device_(device) {
  if (device.is_cuda()) stream_ = cuda::create_stream(device.ordinal());
  if (device.scheduler() != nullptr) queue_ = device.scheduler()->add_queue();
}
ExecContext::~ExecContext() {
  if (stream_ != nullptr) cuda::destroy_stream(stream_);
}

void ExecContext::submit(const char* name, std::function<void()> work) {
  if (recording_ != nullptr)
    recording_->push_back(std::move(work));
  else if (queue_ >= 0)
    device_.scheduler()->submit(queue_, name, std::move(work));
  else
    work();
}

void ExecContext::finish_profiled(const char* name, double begin_s) noexcept {
  try {
    synchronize();
    profile_->add(name, begin_s, now_s());
  } catch (const Error&) {
    profile_ = nullptr;  // the failure comes back at the caller's own synchronize
  }
}

void ExecContext::reserve_scratch(Index n) {
  if (device_.is_cuda()) scratch(cuda::algorithm_scratch_bytes(n));
}

void* ExecContext::scratch(std::size_t bytes) {
  if (scratch_.empty() || static_cast<std::size_t>(scratch_.back().size()) < bytes) {
    scratch_.emplace_back(device_, static_cast<std::int64_t>(bytes));
  }
  return scratch_.back().view().data();
}

void ExecContext::exclusive_scan(const char* name, View<const Index> in, View<Index> out) {
  const KernelTimer timer(*this, name);
  check_copy(static_cast<std::size_t>(in.size()), out.size());
  if (!device_.is_cuda()) return submit(name, [in, out] { scan_on_cpu(in, out); });
  const std::size_t bytes = cuda::algorithm_scratch_bytes(in.size());
  cuda::exclusive_scan(device_.ordinal(), scratch(bytes), bytes, in.data(), out.data(), in.size(), stream_);
}

void ExecContext::exclusive_scan(const char* name, Count count, View<const Index> in, View<Index> out) {
  if (device_.is_cuda()) return exclusive_scan(name, in, out);  // it learns the count too late
  const KernelTimer timer(*this, name);
  check_capacity(count, min(in.size(), out.size()));
  submit(name, [=] { scan_on_cpu(in.part(0, count.get()), out); });
}

void ExecContext::exclusive_scan(const char* name, View<const std::uint64_t> in, View<std::uint64_t> out) {
  const KernelTimer timer(*this, name);
  check_copy(static_cast<std::size_t>(in.size()), out.size());
  if (!device_.is_cuda()) return submit(name, [in, out] { scan_on_cpu(in, out); });
  const std::size_t bytes = cuda::algorithm_scratch_bytes(in.size());
  cuda::exclusive_scan(device_.ordinal(), scratch(bytes), bytes, in.data(), out.data(), in.size(), stream_);
}

void ExecContext::compact(const char* name, Count count, View<const Index> flags, View<Index> out,
                          View<Index> out_count) {
  const KernelTimer timer(*this, name);
  check_capacity(count, flags.size());
  if (!device_.is_cuda()) return submit(name, [=] { compact_on_cpu(count.get(), flags, out, out_count); });
  const std::size_t bytes = cuda::algorithm_scratch_bytes(count.capacity);
  cuda::compact(device_.ordinal(), scratch(bytes), bytes, flags.data(), out.data(), out_count.data(), count,
                stream_);
}

void ExecContext::sort_pairs(const char* name, Count count, View<std::uint32_t> keys, View<Index> values,
                             View<std::uint32_t> keys_scratch, View<Index> values_scratch, int key_bits) {
  const KernelTimer timer(*this, name);
  check_capacity(count, keys.size());
  if (!device_.is_cuda()) {
    return submit(name,
                  [=] { sort_on_cpu(count.get(), keys, values, keys_scratch, values_scratch, key_bits); });
  }
  const std::size_t bytes = cuda::algorithm_scratch_bytes(keys.size());
  cuda::sort_pairs(device_.ordinal(), scratch(bytes), bytes, keys.data(), values.data(), keys_scratch.data(),
                   values_scratch.data(), keys.size(), key_bits, stream_);
}

void ExecContext::sum(const char* name, View<const float> in, View<float> out, View<float> scratch) {
  // Each level writes behind the one before; the last writes the result.
  while (true) {
    const Index chunks = std::max(1, ceil_div(in.size(), kSumChunk));
    const View<float> level = chunks == 1 ? out : scratch.part(0, chunks);
    parallel_for(name, chunks, SumChunk{in, level});
    if (chunks == 1) return;
    in = level;
    scratch = scratch.part(chunks, scratch.size() - chunks);
  }
}

void detail::refuse_on_gpu(const char* name, const char* type) {
  throw Error("kernel '" + std::string(name) + "' (" + type +
              ") was built for the CPU only (TACTUS_HOST_KERNEL): run it on 'cpu', or list it in a .cu file");
}

void ExecContext::check_copy(std::size_t from, Index to) {
  if (from != static_cast<std::size_t>(to)) {
    throw Error("sizes differ: " + std::to_string(from) + " elements into " + std::to_string(to));
  }
}

void ExecContext::check_capacity(const Count& count, Index capacity) {
  if (count.capacity > capacity)
    throw Error("up to " + std::to_string(count.capacity) + " elements asked for, of " +
                std::to_string(capacity));
}

void ExecContext::copy_bytes(void* to, const void* from, std::size_t bytes, CopyKind kind) {
  if (bytes == 0) return;
  if (device_.is_cuda()) return cuda::copy(device_.ordinal(), to, from, bytes, stream_);
  static constexpr const char* kNames[] = {"upload", "download", "copy"};
  submit(kNames[static_cast<int>(kind)], [=] { std::memcpy(to, from, bytes); });
}

void ExecContext::fill(void* what, std::uint8_t byte, std::size_t bytes) {
  if (bytes == 0) return;
  if (device_.is_cuda()) return cuda::fill(device_.ordinal(), what, byte, bytes, stream_);
  submit("fill", [=] { std::memset(what, byte, bytes); });
}

void ExecContext::record(Event& event) {
  if (queue_ >= 0) return device_.scheduler()->record(queue_, event.impl().flag);
  if (!device_.is_cuda()) return;
  if (event.impl().cuda_event == nullptr) event.impl().cuda_event = cuda::create_event(device_.ordinal());
  cuda::record_event(device_.ordinal(), event.impl().cuda_event, stream_);
}

void ExecContext::wait(const Event& event) {
  if (queue_ >= 0) return device_.scheduler()->wait(queue_, event.impl().flag);
  if (device_.is_cuda() && event.impl().cuda_event != nullptr) {
    cuda::wait_event(device_.ordinal(), stream_, event.impl().cuda_event);
  }
}

void ExecContext::synchronize() {
  if (queue_ >= 0) device_.scheduler()->drain(queue_);
  if (device_.is_cuda()) cuda::synchronize(device_.ordinal(), stream_);
}

void ExecContext::synchronize(const Event& event) {
  if (queue_ >= 0) return device_.scheduler()->drain(queue_);
  if (device_.is_cuda() && event.impl().cuda_event != nullptr)
    cuda::synchronize_event(device_.ordinal(), event.impl().cuda_event);
}

Graph ExecContext::capture(const std::function<void()>& body) {
  Graph graph;
  capturing_ = true;
  if (device_.is_cuda()) {
    cuda::begin_capture(device_.ordinal(), stream_);
    body();
    graph.impl().cuda_graph = cuda::end_capture(device_.ordinal(), stream_);
    capturing_ = false;
    return graph;
  }
  recording_ = &graph.impl().steps;
  body();
  recording_ = nullptr;
  capturing_ = false;
  return graph;
}

void ExecContext::launch(Graph& graph) {
  if (device_.is_cuda()) return cuda::launch_graph(device_.ordinal(), graph.impl().cuda_graph, stream_);
  for (const std::function<void()>& step : graph.impl().steps) submit("graph", step);
}

}  // namespace tactus
