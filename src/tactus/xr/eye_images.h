#pragma once
/// The images of an eye, which the runtime owns: colours, and depths where it takes them. Internal to xr/.
#include <optional>

#include "tactus/view/gl_objects.h"
#include "tactus/xr/xr_session.h"

namespace tactus {

/// Images of one kind that the runtime lends one after another.
class XrImages {
 public:
  XrImages(const XrViewSession& session, std::int64_t format, XrSwapchainUsageFlags usage, Vec2i size_px);
  /// Waits for the next one. @returns its texture
  GLuint acquire();
  void release();
  XrSwapchainSubImage whole() const;

 private:
  XrSwapchain chain_ = XR_NULL_HANDLE;
  Vec2i size_px_;
  std::vector<XrSwapchainImageOpenGLKHR> images_;
};

/// What one eye is drawn into.
class EyeImages {
 public:
  /// @throws Error when the runtime has no sRGB images.
  EyeImages(const XrViewSession& session, bool takes_depth, Vec2i size_px);
  bool has_depth() const { return depth_.has_value(); }
  /// The framebuffer of the next images becomes the current one.
  void begin();
  /// They go to the runtime.
  void end();
  XrSwapchainSubImage color() const { return color_->whole(); }
  XrSwapchainSubImage depth() const { return depth_->whole(); }

 private:
  std::optional<XrImages> color_, depth_;
  GlFramebuffer framebuffer_;
};

}  // namespace tactus
