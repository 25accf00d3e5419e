#pragma once
/// Marks functions that run on the host and on a CUDA device. The only place, with compute/, that knows of
/// nvcc.
#include <cstddef>
#include <cstdint>

#if defined(__CUDACC__)
#define TACTUS_HD __host__ __device__
#else
#define TACTUS_HD
#endif

/// Before a loop in which a thread does much: nvcc then writes it once, not eight times. Kernels of little
/// work wait for their code, which a GPU fetches from memory: on an H200, a quarter to a half of the cycles
/// between two instructions of a warp.
#if defined(__CUDA_ARCH__)
#define TACTUS_ROLLED _Pragma("unroll 1")
#else
#define TACTUS_ROLLED
#endif
/// In place of TACTUS_HD on a function that kernels use often, for the same reason: one copy of it is called.
#if defined(__CUDACC__)
#define TACTUS_HD_CALLED __host__ __device__ __noinline__
#else
#define TACTUS_HD_CALLED
#endif

/// On large functions and lambdas that loops over lanes call: a loop with a call in it doesn't vectorise.
#define TACTUS_ALWAYS_INLINE __attribute__((always_inline))

namespace tactus {
/// Index of one element; all arrays of one device hold fewer than 2^31 elements.
using Index = std::int32_t;
}  // namespace tactus
