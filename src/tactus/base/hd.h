#pragma once
/// Marks what runs on the host and on a CUDA device. The only place, with compute/, that knows of nvcc.
#include <cstddef>
#include <cstdint>

#if defined(__CUDACC__)
#define TACTUS_HD __host__ __device__
#else
#define TACTUS_HD
#endif

/// On large functions and lambdas that loops over lanes call: a loop with a call in it doesn't vectorise.
#define TACTUS_ALWAYS_INLINE __attribute__((always_inline))

namespace tactus {
/// Index of one element; all arrays of one device hold fewer than 2^31 elements.
using Index = std::int32_t;
}  // namespace tactus
