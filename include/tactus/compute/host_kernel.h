#pragma once
/// Kernels of a program that is built without nvcc. `parallel_for` of a Tactus with CUDA refers to the GPU's
/// half of every kernel; this line, after the struct and outside of every namespace, says that there is none:
///
///   struct Halve { tactus::View<float> x; void operator()(tactus::Index i) const { x[i] /= 2; } };
///   TACTUS_HOST_KERNEL(Halve);
///
/// The kernel then runs on `cpu` and `cpu:N`; on a GPU `parallel_for` throws an Error that names it. A kernel
/// that is to run on GPUs stands in a .cu file as TACTUS_CUDA_KERNEL(Halve) (compute/cuda/kernel_launch.cuh)
/// instead, never in both. Without this line (and without the .cu file) the linker names the kernel.
#include "tactus/compute/exec_context.h"

namespace tactus::detail {
/// @throws Error always: `type` has no GPU half.
[[noreturn]] void refuse_on_gpu(const char* name, const char* type);
}  // namespace tactus::detail

#define TACTUS_HOST_KERNEL(K)                                                                               \
  template <>                                                                                               \
  inline void tactus::detail::launch_cuda<K, sizeof(K), alignof(K)>(void*, const char* name, tactus::Count, \
                                                                    const K&) {                             \
    tactus::detail::refuse_on_gpu(name, #K);                                                                \
  }                                                                                                         \
  static_assert(true, "takes the semicolon")
