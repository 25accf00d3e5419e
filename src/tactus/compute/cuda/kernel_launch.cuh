#pragma once
/// Included by a folder's kernels.cu, which lists its kernels: `TACTUS_CUDA_KERNEL(HullPyramid,
/// ClassifyBricks);` Nothing else may be compiled by nvcc.
#include <cuda_runtime.h>

#include <algorithm>
#include <string>

#include "tactus/compute/cuda/cuda_check.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// One block on a GPU: a thread a lane.
template <int kThreads>
class CudaBlock {
 public:
  static constexpr bool kIsLoop = false;
  template <class T>
  struct PerThread {
    T value;
    __device__ T& operator[](int) { return value; }
    __device__ const T& operator[](int) const { return value; }
  };
  __device__ explicit CudaBlock(Index index) : index_(index) {}
  __device__ Index index() const { return index_; }
  template <class F>
  __device__ void for_each_thread(F&& f) const {
    f(static_cast<int>(threadIdx.x));
    __syncthreads();
  }

  template <class F>
  __device__ void for_threads(int count, F&& f) const {
    if (static_cast<int>(threadIdx.x) < count) f(static_cast<int>(threadIdx.x));
    __syncthreads();
  }
  template <class F>
  __device__ void for_range(int count, F&& f) const {
    for (int i = static_cast<int>(threadIdx.x); i < count; i += kThreads) f(i);
    __syncthreads();
  }
  template <class F>
  __device__ void for_own(int count, F&& f) const {
    if (static_cast<int>(threadIdx.x) < count) f(static_cast<int>(threadIdx.x));
  }
  template <int kGroup, class S, class F>
  __device__ void for_own_groups(int count, S&& select, F&& f) const {
    const int g = static_cast<int>(threadIdx.x) / kGroup;
    if (g < count && select(g)) f(g, static_cast<int>(threadIdx.x) % kGroup);
  }
  template <int kGroup, class S, class F>
  __device__ void for_groups(int count, S&& select, F&& f) const {
    static_assert(kThreads % kGroup == 0);
    for (int g = static_cast<int>(threadIdx.x) / kGroup; g < count; g += kThreads / kGroup) {
      if (select(g)) f(g, static_cast<int>(threadIdx.x) % kGroup);
    }
    __syncthreads();
  }
  template <class P>
  __device__ void compact(int count, P&& chosen, int* out, int* out_count) const {
    static_assert(kThreads % 32 == 0);
    __shared__ int warp_count[kThreads / 32];
    const int t = static_cast<int>(threadIdx.x), warp = t / 32, lane = t % 32;
    const bool is_chosen = t < count && chosen(t);
    const unsigned votes = __ballot_sync(~0U, is_chosen);
    if (lane == 0) warp_count[warp] = __popc(votes);
    __syncthreads();
    int at = __popc(votes & ((1U << lane) - 1U)), total = 0;
    for (int w = 0; w < kThreads / 32; ++w) {
      at += w < warp ? warp_count[w] : 0;
      total += warp_count[w];
    }
    if (is_chosen) out[at] = t;
    if (t == 0) *out_count = total;
    __syncthreads();
  }
  template <class T>
  __device__ PerThread<T> previous(const PerThread<T>& values) const {
    static_assert(kThreads % 32 == 0);
    return {__shfl_up_sync(~0U, values.value, 1)};
  }
  __device__ void barrier() const { __syncthreads(); }
  template <class F>
  __device__ void on_one_thread(F&& f) const {
    if (threadIdx.x == 0) f();
    __syncthreads();
  }

 private:
  Index index_;
};

/// One of several blocks whose threads keep to themselves.
template <int kThreads>
class CudaLanes {
 public:
  static constexpr bool kIsLoop = false;
  template <class T>
  using PerThread = typename CudaBlock<kThreads>::template PerThread<T>;
  __device__ explicit CudaLanes(Index index) : index_(index) {}
  __device__ Index index() const { return index_; }
  template <class F>
  __device__ void for_each_thread(F&& f) const {
    f(static_cast<int>(threadIdx.x) % kThreads);
  }

 private:
  Index index_;
};

namespace detail {

template <class K, std::size_t kSize, std::size_t kAlign>
void launch_cuda(void* cuda_stream, const char* name, Count count, const K& kernel);

/// The kernel as its threads use it: what it loads is the same for all of them.
template <class K>
__device__ __forceinline__ decltype(auto) loaded(const K& kernel) {
  if constexpr (LoadingKernel<K>) {
    K copy = kernel;
    copy.load();
    return copy;
  } else {
    return (kernel);
  }
}

template <class K>
__global__ void __launch_bounds__(256) for_kernel(const __grid_constant__ K kernel, Count count) {
  const Index n = count.get();
  const Index stride = static_cast<Index>(gridDim.x * blockDim.x);
  const auto& k = loaded(kernel);
  for (Index i = static_cast<Index>(blockIdx.x * blockDim.x + threadIdx.x); i < n; i += stride) k(i);
}

/// Blocks of a kernel that a multiprocessor should hold at once, at the price of registers: what waits for
/// memory more than it computes names kLeastBlocks.
template <class K>
constexpr int least_blocks() {
  if constexpr (requires { K::kLeastBlocks; })
    return K::kLeastBlocks;
  else
    return 0;  // as the compiler likes
}

template <class K>
__global__ void __launch_bounds__(K::kThreads, least_blocks<K>())
    block_kernel(const __grid_constant__ K kernel, Count count) {
  __shared__ typename K::Shared shared;
  const Index n = count.get();
  const auto& k = loaded(kernel);
  for (Index i = static_cast<Index>(blockIdx.x); i < n; i += static_cast<Index>(gridDim.x)) {
    k(CudaBlock<K::kThreads>(i), shared);
  }
}

constexpr int kLanesThreads = 128;

template <class K>
__global__ void __launch_bounds__(kLanesThreads) lanes_kernel(const __grid_constant__ K kernel, Count count) {
  constexpr int kBlocks = kLanesThreads / K::kThreads;
  static_assert(kBlocks * K::kThreads == kLanesThreads);
  typename K::Shared shared;
  const Index n = count.get();
  const auto& k = loaded(kernel);
  const auto first = static_cast<Index>(blockIdx.x * kBlocks + threadIdx.x / K::kThreads);
  for (Index i = first; i < n; i += static_cast<Index>(gridDim.x) * kBlocks)
    k(CudaLanes<K::kThreads>(i), shared);
}

/// Launches are sized for the capacity; where the count is only known on the device, a few blocks per
/// multiprocessor stride over it: enough to fill it, and no more, as starting them is what an empty launch
/// costs.
inline Index grid_size(Index work, bool on_device, int threads) {
  return on_device ? std::min<Index>(work, 132 * std::clamp(2048 / threads, 8, 32)) : work;
}

template <class K, std::size_t kSize, std::size_t kAlign>
void launch_cuda(void* cuda_stream, const char* name, Count count, const K& kernel) {
  static_assert(sizeof(K) == kSize && alignof(K) == kAlign);
  const auto stream = static_cast<cudaStream_t>(cuda_stream);
  if constexpr (requires(typename K::Shared s) { NoShared(s); }) {
    constexpr Index kBlocks = kLanesThreads / K::kThreads;
    lanes_kernel<K>
        <<<grid_size((count.capacity + kBlocks - 1) / kBlocks, count.device_count != nullptr, kLanesThreads),
           kLanesThreads, 0, stream>>>(kernel, count);
  } else if constexpr (requires { typename K::Shared; }) {
    block_kernel<K>
        <<<grid_size(count.capacity, count.device_count != nullptr, K::kThreads), K::kThreads, 0, stream>>>(
            kernel, count);
  } else {
    for_kernel<K>
        <<<grid_size((count.capacity + 255) / 256, count.device_count != nullptr, 256), 256, 0, stream>>>(
            kernel, count);
  }
  cuda::check(cudaGetLastError(), name, __FILE__, __LINE__);
}

}  // namespace detail
}  // namespace tactus

/// Takes a template with several arguments, too.
#define TACTUS_CUDA_KERNEL(...)                                                                      \
  template void tactus::detail::launch_cuda<__VA_ARGS__, sizeof(__VA_ARGS__), alignof(__VA_ARGS__)>( \
      void*, const char*, tactus::Count, const __VA_ARGS__&)
