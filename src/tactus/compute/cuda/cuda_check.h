#pragma once
#include <cuda_runtime_api.h>

#include <string>

#include "tactus/base/error.h"

namespace tactus::cuda {
/// @throws Error naming the call, its place, the device and CUDA's message.
inline void check(cudaError_t status, const char* call, const char* file, int line) {
  if (status == cudaSuccess) return;
  int device = -1;
  cudaGetDevice(&device);
  cudaGetLastError();
  throw Error(std::string(call) + " failed on cuda:" + std::to_string(device) + " (" + file + ":" +
              std::to_string(line) + "): " + cudaGetErrorString(status));
}
}  // namespace tactus::cuda
#define TACTUS_CUDA_CHECK(call) ::tactus::cuda::check((call), #call, __FILE__, __LINE__)
