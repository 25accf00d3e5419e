#include "tactus/compute/gl_sharing.h"

#include "tactus/compute/cuda/cuda_backend.h"

namespace tactus {

std::string why_not_shared_with_gl(const Device& device) {
  if (!device.is_cuda()) return device.name() + " is the host: its memory is drawn from directly";
  return cuda::why_not_shared_with_gl(device.ordinal());
}

GlSharedBuffer::GlSharedBuffer(const Device& device, unsigned gl_buffer)
    : ordinal_(device.ordinal()), resource_(cuda::register_gl_buffer(device.ordinal(), gl_buffer)) {}

GlSharedBuffer::~GlSharedBuffer() {
  if (resource_ != nullptr) cuda::unregister_gl_buffer(ordinal_, resource_);
}

GlSharedBuffer::GlSharedBuffer(GlSharedBuffer&& other) noexcept
    : ordinal_(other.ordinal_), resource_(std::exchange(other.resource_, nullptr)) {}

GlSharedBuffer& GlSharedBuffer::operator=(GlSharedBuffer&& other) noexcept {
  std::swap(ordinal_, other.ordinal_);
  std::swap(resource_, other.resource_);
  return *this;
}

void GlSharedBuffer::copy_from(ExecContext& ctx, const void* device_memory, std::size_t bytes) {
  cuda::copy_to_gl_buffer(ordinal_, resource_, device_memory, bytes, ctx.cuda_stream());
}

}  // namespace tactus
