// OpenGL's buffers as memory of a GPU.
#include <cuda_gl_interop.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "tactus/compute/cuda/cuda_backend.h"
#include "tactus/compute/cuda/cuda_check.h"

namespace tactus::cuda {

std::string why_not_shared_with_gl(int ordinal) {
  std::array<int, 32> devices{};
  unsigned count = 0;
  const cudaError_t status =
      cudaGLGetDevices(&count, devices.data(), static_cast<unsigned>(devices.size()), cudaGLDeviceListAll);
  if (status != cudaSuccess) {
    cudaGetLastError();
    return std::string("CUDA and this OpenGL don't know each other: ") + cudaGetErrorString(status);
  }
  const auto end = devices.begin() + std::min<std::ptrdiff_t>(count, std::ssize(devices));
  if (std::find(devices.begin(), end, ordinal) == end)
    return "OpenGL draws on another GPU than cuda:" + std::to_string(ordinal);
  return "";
}

void* register_gl_buffer(int ordinal, unsigned gl_buffer) {
  TACTUS_CUDA_CHECK(cudaSetDevice(ordinal));
  cudaGraphicsResource* resource = nullptr;
  TACTUS_CUDA_CHECK(
      cudaGraphicsGLRegisterBuffer(&resource, gl_buffer, cudaGraphicsRegisterFlagsWriteDiscard));
  return resource;
}

void unregister_gl_buffer(int ordinal, void* resource) noexcept {
  cudaSetDevice(ordinal);
  cudaGraphicsUnregisterResource(static_cast<cudaGraphicsResource*>(resource));
}

void copy_to_gl_buffer(int ordinal, void* resource, const void* from, std::size_t bytes, void* stream) {
  TACTUS_CUDA_CHECK(cudaSetDevice(ordinal));
  auto* shared = static_cast<cudaGraphicsResource*>(resource);
  auto* const queue = static_cast<cudaStream_t>(stream);
  TACTUS_CUDA_CHECK(cudaGraphicsMapResources(1, &shared, queue));
  void* to = nullptr;
  std::size_t capacity = 0;
  cudaError_t status = cudaGraphicsResourceGetMappedPointer(&to, &capacity, shared);
  if (status == cudaSuccess)
    status = capacity < bytes ? cudaErrorInvalidValue
                              : cudaMemcpyAsync(to, from, bytes, cudaMemcpyDeviceToDevice, queue);
  TACTUS_CUDA_CHECK(cudaGraphicsUnmapResources(1, &shared, queue));
  TACTUS_CUDA_CHECK(status);
}

}  // namespace tactus::cuda
