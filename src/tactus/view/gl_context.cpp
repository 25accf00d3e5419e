#include "tactus/view/gl_context.h"

#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <array>
#include <cstring>
#include <vector>

#include "tactus/base/error.h"

namespace tactus {
namespace {

bool has(const char* extensions, const char* name) {
  return extensions != nullptr && std::strstr(extensions, name) != nullptr;
}

/// Displays that need no window system, best first: GPUs, Mesa's surfaceless platform, software devices.
std::vector<EGLDisplay> candidate_displays() {
  const char* client = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  std::vector<EGLDisplay> hardware, software;
  if (has(client, "EGL_EXT_platform_base") && has(client, "EGL_EXT_device_enumeration") &&
      has(client, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 32> devices{};
    EGLint count = 0;
    if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count)) {
      for (EGLint i = 0; i < count; ++i) {
        const EGLDeviceEXT device = devices[static_cast<std::size_t>(i)];
        const char* names =
            has(client, "EGL_EXT_device_query") ? eglQueryDeviceStringEXT(device, EGL_EXTENSIONS) : nullptr;
        (has(names, "EGL_MESA_device_software") ? software : hardware)
            .push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, device, nullptr));
      }
    }
  }
  if (has(client, "EGL_MESA_platform_surfaceless")) {
    hardware.push_back(eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  }
  hardware.insert(hardware.end(), software.begin(), software.end());
  return hardware;
}

/// A context of an initialised display, or null with the reason.
EGLContext open(EGLDisplay display, std::string& why) {
  if (!has(eglQueryString(display, EGL_EXTENSIONS), "EGL_KHR_surfaceless_context") ||
      !eglBindAPI(EGL_OPENGL_API)) {
    why = "no OpenGL without a surface";
    return nullptr;
  }
  const EGLint config_request[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                   EGL_NONE};
  EGLConfig config = nullptr;
  EGLint configs = 0;
  if (!eglChooseConfig(display, config_request, &config, 1, &configs) || configs == 0) {
    why = "no configuration for OpenGL";
    return nullptr;
  }
  const EGLint request[] = {EGL_CONTEXT_MAJOR_VERSION,
                            4,
                            EGL_CONTEXT_MINOR_VERSION,
                            5,
                            EGL_CONTEXT_OPENGL_PROFILE_MASK,
                            EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                            EGL_NONE};
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, request);
  if (context == EGL_NO_CONTEXT) why = "no OpenGL 4.5 core profile";
  return context;
}

/// libepoxy ends the process when there is no libEGL; a machine without pictures is no reason for that.
void require_egl() {
  static const void* const library =
      dlopen("libEGL.so.1", RTLD_LAZY | RTLD_LOCAL);  // stays open: epoxy's is the same
  if (library == nullptr) throw Error("no OpenGL: this machine has no libEGL.so.1");
}

}  // namespace

GlContext::GlContext() {
  require_egl();
  std::string reasons;
  for (const EGLDisplay display : candidate_displays()) {
    EGLint major = 0, minor = 0;
    std::string why = "can't be initialised";
    if (display != EGL_NO_DISPLAY && eglInitialize(display, &major, &minor)) {
      const EGLContext context = open(display, why);
      if (context != EGL_NO_CONTEXT && eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context)) {
        display_ = display;
        context_ = context;
        description_ = current_context_description();
        eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        return;
      }
      if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    }
    const char* vendor = display == EGL_NO_DISPLAY ? nullptr : eglQueryString(display, EGL_VENDOR);
    reasons +=
        (reasons.empty() ? "" : "; ") + std::string(vendor == nullptr ? "EGL device" : vendor) + ": " + why;
  }
  throw Error("no picture can be drawn: " +
              (reasons.empty() ? "EGL offers no display that works without a screen" : reasons) +
              " (Mesa's software driver is enough: Debian package libegl-mesa0)");
}

// The display is left initialised: it is shared by all contexts of the process.
GlContext::~GlContext() { eglDestroyContext(display_, context_); }

std::string current_context_description() {
  return std::string(reinterpret_cast<const char*>(glGetString(GL_RENDERER))) + ", OpenGL " +
         reinterpret_cast<const char*>(glGetString(GL_VERSION));
}

bool is_software(const std::string& description) {
  return has(description.c_str(), "llvmpipe") || has(description.c_str(), "softpipe");
}

GlContext::Current::Current(const GlContext* context) {
  if (context == nullptr) return;
  display_ = context->display_;
  context_ = context->context_;
  previous_display_ = eglGetCurrentDisplay();
  previous_context_ = eglGetCurrentContext();
  previous_draw_ = eglGetCurrentSurface(EGL_DRAW);
  previous_read_ = eglGetCurrentSurface(EGL_READ);
  if (!eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
    throw Error("the renderer is in use by another thread");
}

GlContext::Current::~Current() {
  if (context_ == nullptr) return;
  eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  if (previous_context_ != EGL_NO_CONTEXT)
    eglMakeCurrent(previous_display_, previous_draw_, previous_read_, previous_context_);
}

}  // namespace tactus
