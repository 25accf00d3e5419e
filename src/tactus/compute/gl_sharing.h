#pragma once
/// Buffers of OpenGL as memory of a device: results of kernels are drawn without a copy through the host. An
/// OpenGL context is current in the thread wherever these are called.
#include <string>

#include "tactus/compute/exec_context.h"

namespace tactus {

/// Empty when `device` can write buffers of the current OpenGL context, else why it can't: no GPU, OpenGL on
/// another GPU or in software, an old driver. Call it only for a context of NVIDIA's driver.
std::string why_not_shared_with_gl(const Device& device);

/// A buffer of OpenGL that a GPU writes to.
class GlSharedBuffer {
 public:
  GlSharedBuffer() = default;
  /// @param gl_buffer name of a buffer with storage. @throws Error when the driver refuses.
  GlSharedBuffer(const Device& device, unsigned gl_buffer);
  ~GlSharedBuffer();
  GlSharedBuffer(GlSharedBuffer&& other) noexcept;
  GlSharedBuffer& operator=(GlSharedBuffer&& other) noexcept;

  explicit operator bool() const { return resource_ != nullptr; }
  /// Copies on the GPU after all that was submitted to `ctx`; drawing that is submitted later sees it.
  /// @throws Error on a device failure.
  void copy_from(ExecContext& ctx, const void* device_memory, std::size_t bytes);

 private:
  int ordinal_ = 0;
  void* resource_ = nullptr;
};

}  // namespace tactus
