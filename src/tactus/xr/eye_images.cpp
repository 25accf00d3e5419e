#include "tactus/xr/eye_images.h"

#include <algorithm>

#include "tactus/base/error.h"

namespace tactus {

XrImages::XrImages(const XrViewSession& session, std::int64_t format, XrSwapchainUsageFlags usage,
                   Vec2i size_px)
    : size_px_(size_px) {
  auto made = xr_struct<XrSwapchainCreateInfo>(XR_TYPE_SWAPCHAIN_CREATE_INFO);
  made.usageFlags = usage;
  made.format = format;
  made.sampleCount = made.faceCount = made.arraySize = made.mipCount = 1;
  made.width = static_cast<std::uint32_t>(size_px.x);
  made.height = static_cast<std::uint32_t>(size_px.y);
  check_xr(xrCreateSwapchain(session.get(), &made, &chain_), "xrCreateSwapchain");
  images_ = xr_list<XrSwapchainImageOpenGLKHR>(
      "xrEnumerateSwapchainImages", xr_struct<XrSwapchainImageOpenGLKHR>(XR_TYPE_SWAPCHAIN_IMAGE_OPENGL_KHR),
      [&](std::uint32_t capacity, std::uint32_t* count, XrSwapchainImageOpenGLKHR* list) {
        return xrEnumerateSwapchainImages(chain_, capacity, count,
                                          reinterpret_cast<XrSwapchainImageBaseHeader*>(list));
      });
}

GLuint XrImages::acquire() {
  std::uint32_t index = 0;
  check_xr(xrAcquireSwapchainImage(chain_, nullptr, &index), "xrAcquireSwapchainImage");
  auto wait = xr_struct<XrSwapchainImageWaitInfo>(XR_TYPE_SWAPCHAIN_IMAGE_WAIT_INFO);
  wait.timeout = XR_INFINITE_DURATION;
  check_xr(xrWaitSwapchainImage(chain_, &wait), "xrWaitSwapchainImage");
  return images_.at(index).image;
}

void XrImages::release() { check_xr(xrReleaseSwapchainImage(chain_, nullptr), "xrReleaseSwapchainImage"); }

XrSwapchainSubImage XrImages::whole() const {
  XrSwapchainSubImage image{};
  image.swapchain = chain_;
  image.imageRect.extent = {size_px_.x, size_px_.y};
  return image;
}

EyeImages::EyeImages(const XrViewSession& session, bool takes_depth, Vec2i size_px) {
  const auto formats =
      xr_list<std::int64_t>("xrEnumerateSwapchainFormats", 0,
                            [&](std::uint32_t capacity, std::uint32_t* count, std::int64_t* list) {
                              return xrEnumerateSwapchainFormats(session.get(), capacity, count, list);
                            });
  const auto offers = [&](std::int64_t format) {
    return std::find(formats.begin(), formats.end(), format) != formats.end();
  };
  if (!offers(GL_SRGB8_ALPHA8)) throw Error("the OpenXR runtime has no images of the format GL_SRGB8_ALPHA8");
  color_.emplace(session, GL_SRGB8_ALPHA8, XR_SWAPCHAIN_USAGE_COLOR_ATTACHMENT_BIT, size_px);
  // The renderer's own format: it is copied, not drawn again.
  if (takes_depth && offers(GL_DEPTH_COMPONENT32F))
    depth_.emplace(session, GL_DEPTH_COMPONENT32F, XR_SWAPCHAIN_USAGE_DEPTH_STENCIL_ATTACHMENT_BIT, size_px);
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  framebuffer_ = GlFramebuffer(name);
}

void EyeImages::begin() {
  glNamedFramebufferTexture(framebuffer_.get(), GL_COLOR_ATTACHMENT0, color_->acquire(), 0);
  if (depth_) glNamedFramebufferTexture(framebuffer_.get(), GL_DEPTH_ATTACHMENT, depth_->acquire(), 0);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.get());
}

void EyeImages::end() {
  color_->release();
  if (depth_) depth_->release();
}

}  // namespace tactus
