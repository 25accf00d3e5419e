#pragma once
/// Included by a folder's kernels.cu, which lists its kernels: `TACTUS_CUDA_KERNEL(HullPyramid,
/// ClassifyBricks);` Nothing else may be compiled by nvcc.
#include <cuda_runtime.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <type_traits>

#include "tactus/compute/cuda/cuda_backend.h"
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
  __device__ void for_few(int count, F&& f) const {
    TACTUS_ROLLED
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

/// The kernel as its threads use it: all of them load the same numbers.
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

/// Likewise. A kernel that names kLoadsTogether is so large that its functions aren't all inlined: a copy for
/// every thread would go through memory (50 us a launch), so the threads of a block share one.
template <class K>
__device__ __forceinline__ decltype(auto) loaded_by_block(const K& kernel) {
  if constexpr (requires { K::kLoadsTogether; }) {
    static_assert(std::is_trivially_copyable_v<K> && sizeof(K) % sizeof(unsigned) == 0);
    __shared__ unsigned words[sizeof(K) / sizeof(unsigned) + 2];  // and capacity to align
    K& copy = *reinterpret_cast<K*>((reinterpret_cast<std::uintptr_t>(words) + alignof(K) - 1) / alignof(K) *
                                    alignof(K));
    for (unsigned w = threadIdx.x; w < sizeof(K) / sizeof(unsigned); w += blockDim.x)
      reinterpret_cast<unsigned*>(&copy)[w] = reinterpret_cast<const unsigned*>(&kernel)[w];
    __syncthreads();
    if (threadIdx.x == 0) copy.load();
    __syncthreads();
    return static_cast<const K&>(copy);
  } else {
    return loaded(kernel);
  }
}

/// First thing in every kernel. A kernel is started while the one before it in the stream still runs, which
/// hides the time of a start. It waits here until that one has ended and its results can be seen
/// (programmatic dependent launch, from compute capability 9.0 on). Only after that the next one may be
/// started: on an H200, frames were 4 % slower where several waited.
__device__ inline void wait_for_the_kernel_before() {
#if __CUDA_ARCH__ >= 900
  cudaGridDependencySynchronize();
  cudaTriggerProgrammaticLaunchCompletion();
#endif
}

template <class K>
__global__ void __launch_bounds__(256) for_kernel(const __grid_constant__ K kernel, Count count) {
  wait_for_the_kernel_before();
  const Index n = count.get();
  const Index stride = static_cast<Index>(gridDim.x * blockDim.x);
  const auto& k = loaded(kernel);
  for (Index i = static_cast<Index>(blockIdx.x * blockDim.x + threadIdx.x); i < n; i += stride) k(i);
}

/// Blocks of a kernel that a multiprocessor should hold at once, at the price of registers: a kernel that
/// waits for memory more than it computes names kLeastBlocks.
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
  wait_for_the_kernel_before();
  const Index n = count.get();
  const auto& k = loaded_by_block(kernel);  // for nothing in some blocks, but at the same time as the count
  if (static_cast<Index>(blockIdx.x) >= n) return;
  for (Index i = static_cast<Index>(blockIdx.x); i < n; i += static_cast<Index>(gridDim.x)) {
    k(CudaBlock<K::kThreads>(i), shared);
  }
}

constexpr int kLanesThreads = 128;
/// Blocks a multiprocessor that stride over work: each of their groups does more or less of it, and of more
/// blocks than fit, those that end early make way for others (705,000 particles on an H200: 5 % of a step).
constexpr int kLanesBlocks = 16;

template <class K>
__global__ void __launch_bounds__(kLanesThreads) lanes_kernel(const __grid_constant__ K kernel, Count count) {
  constexpr int kBlocks = kLanesThreads / K::kThreads;
  static_assert(kBlocks * K::kThreads == kLanesThreads);
  typename K::Shared shared;
  wait_for_the_kernel_before();
  const Index n = count.get();
  const auto& k = loaded(kernel);
  const auto first = static_cast<Index>(blockIdx.x * kBlocks + threadIdx.x / K::kThreads);
  for (Index i = first; i < n; i += static_cast<Index>(gridDim.x) * kBlocks)
    k(CudaLanes<K::kThreads>(i), shared);
}

/// Blocks that share the work of a launch whose count is only known on the device: as many as a GPU holds at
/// once, as each further block makes an empty launch slower, and at least `least` a multiprocessor. The GPUs
/// of a set are alike.
inline Index striding_blocks(const void* run, int threads, int least) {
  int device = 0, multiprocessors = 0, resident = 0;
  TACTUS_CUDA_CHECK(cudaGetDevice(&device));
  TACTUS_CUDA_CHECK(cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  TACTUS_CUDA_CHECK(cudaOccupancyMaxActiveBlocksPerMultiprocessor(&resident, run, threads, 0));
  return multiprocessors * std::max(resident, least);
}

/// Whether the code of a kernel has wait_for_the_kernel_before(): only then may it start before the one in
/// front has ended. Code that a driver makes of older PTX lacks it, on any GPU. The GPUs of a set are alike.
inline bool waits_itself(const void* run) {
  const auto from = std::chrono::steady_clock::now();
  cudaFuncAttributes code{};
  TACTUS_CUDA_CHECK(cudaFuncGetAttributes(&code, run));
  cuda::note_slow_load(std::chrono::duration<double>(std::chrono::steady_clock::now() - from).count());
  return code.ptxVersion >= 90 && code.binaryVersion >= 90;
}

/// Starts a kernel that begins with wait_for_the_kernel_before(), for count.capacity / per_block blocks of
/// work.
template <int kLeastEach, class K>
void start(void (*run)(K, Count), Index per_block, int threads, cudaStream_t stream, const char* name,
           Count count, const K& kernel) {
  Index blocks = (count.capacity + per_block - 1) / per_block;
  if (count.device_count != nullptr) {
    static const Index most = striding_blocks(reinterpret_cast<const void*>(run), threads, kLeastEach);
    blocks = std::min(blocks, most);
  }
  static const bool starts_early = waits_itself(reinterpret_cast<const void*>(run));
  cudaLaunchAttribute early{};
  early.id = cudaLaunchAttributeProgrammaticStreamSerialization;
  early.val.programmaticStreamSerializationAllowed = 1;
  cudaLaunchConfig_t config{};
  config.gridDim = dim3(static_cast<unsigned>(blocks));
  config.blockDim = dim3(static_cast<unsigned>(threads));
  config.stream = stream;
  config.attrs = &early;
  config.numAttrs = starts_early ? 1 : 0;
  cuda::check(cudaLaunchKernelEx(&config, run, kernel, count), name, __FILE__, __LINE__);
}

template <class K, std::size_t kSize, std::size_t kAlign>
void launch_cuda(void* cuda_stream, const char* name, Count count, const K& kernel) {
  static_assert(sizeof(K) == kSize && alignof(K) == kAlign);
  const auto stream = static_cast<cudaStream_t>(cuda_stream);
  if constexpr (requires(typename K::Shared s) { NoShared(s); }) {
    start<kLanesBlocks, K>(lanes_kernel<K>, kLanesThreads / K::kThreads, kLanesThreads, stream, name, count,
                           kernel);
  } else if constexpr (requires { typename K::Shared; }) {
    start<1, K>(block_kernel<K>, 1, K::kThreads, stream, name, count, kernel);
  } else {
    start<1, K>(for_kernel<K>, 256, 256, stream, name, count, kernel);
  }
}

}  // namespace detail
}  // namespace tactus

/// Takes a template with several arguments, too.
#define TACTUS_CUDA_KERNEL(...)                                                                      \
  template void tactus::detail::launch_cuda<__VA_ARGS__, sizeof(__VA_ARGS__), alignof(__VA_ARGS__)>( \
      void*, const char*, tactus::Count, const __VA_ARGS__&)
