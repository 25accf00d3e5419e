#include "tactus/xr/xr_session.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr XrViewConfigurationType kStereo = XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO;

/// The session's configuration for EGL is that of the context.
EGLConfig config_of(EGLDisplay display, EGLContext context) {
  EGLint id = 0, count = 0;
  EGLConfig config = nullptr;
  eglQueryContext(display, context, EGL_CONFIG_ID, &id);
  const std::array<EGLint, 3> wanted{EGL_CONFIG_ID, id, EGL_NONE};
  eglChooseConfig(display, wanted.data(), &config, 1, &count);
  return config;
}

}  // namespace

XrSystem::XrSystem() {
  // The loader's own lines would stand beside our message; who asks for them gets them.
  ::setenv("XR_LOADER_DEBUG", "none", 0);
  create();
  auto wanted = xr_struct<XrSystemGetInfo>(XR_TYPE_SYSTEM_GET_INFO);
  wanted.formFactor = XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY;
  try {
    check_xr(xrGetSystem(instance_, &wanted, &id_), "xrGetSystem");
    auto properties = xr_struct<XrSystemProperties>(XR_TYPE_SYSTEM_PROPERTIES);
    check_xr(xrGetSystemProperties(instance_, id_, &properties), "xrGetSystemProperties");
    description_ = std::string(properties.systemName) + " by " + runtime_;
  } catch (...) {
    xrDestroyInstance(instance_);
    throw;
  }
}

void XrSystem::create() {
  const auto offered = xr_list<XrExtensionProperties>(
      "xrEnumerateInstanceExtensionProperties",
      xr_struct<XrExtensionProperties>(XR_TYPE_EXTENSION_PROPERTIES),
      [](std::uint32_t capacity, std::uint32_t* count, XrExtensionProperties* list) {
        return xrEnumerateInstanceExtensionProperties(nullptr, capacity, count, list);
      });
  const auto offers = [&](const char* name) {
    return std::any_of(offered.begin(), offered.end(),
                       [&](const auto& e) { return std::strcmp(e.extensionName, name) == 0; });
  };
  std::vector<const char*> extensions{XR_KHR_OPENGL_ENABLE_EXTENSION_NAME, XR_MNDX_EGL_ENABLE_EXTENSION_NAME};
  for (const char* needed : extensions)
    if (!offers(needed))
      throw Error(std::string("the OpenXR runtime doesn't draw with OpenGL and EGL: it has no ") + needed +
                  ". Monado has; XR_RUNTIME_JSON names the manifest of another runtime");
  takes_depth_ = offers(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME);
  if (takes_depth_) extensions.push_back(XR_KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME);
  knows_bare_hands_ = offers(XR_MSFT_HAND_INTERACTION_EXTENSION_NAME);
  if (knows_bare_hands_) extensions.push_back(XR_MSFT_HAND_INTERACTION_EXTENSION_NAME);
  auto made = xr_struct<XrInstanceCreateInfo>(XR_TYPE_INSTANCE_CREATE_INFO);
  std::snprintf(made.applicationInfo.applicationName, XR_MAX_APPLICATION_NAME_SIZE, "tactus");
  made.applicationInfo.apiVersion = XR_MAKE_VERSION(1, 0, 0);
  made.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  made.enabledExtensionNames = extensions.data();
  check_xr(xrCreateInstance(&made, &instance_), "xrCreateInstance");
  auto properties = xr_struct<XrInstanceProperties>(XR_TYPE_INSTANCE_PROPERTIES);
  if (XR_SUCCEEDED(xrGetInstanceProperties(instance_, &properties))) runtime_ = properties.runtimeName;
}

XrSystem::~XrSystem() { xrDestroyInstance(instance_); }

XrPath XrSystem::path(const std::string& text) const {
  XrPath path = XR_NULL_PATH;
  check_xr(xrStringToPath(instance_, text.c_str(), &path), "xrStringToPath");
  return path;
}

XrViewSession::XrViewSession(const XrSystem& system, const GlContext& context) : system_(system) {
  create(context);
  try {
    find_room();
    const auto modes = xr_list<XrEnvironmentBlendMode>(
        "xrEnumerateEnvironmentBlendModes", XR_ENVIRONMENT_BLEND_MODE_OPAQUE,
        [&](std::uint32_t capacity, std::uint32_t* count, XrEnvironmentBlendMode* list) {
          return xrEnumerateEnvironmentBlendModes(system.instance(), system.id(), kStereo, capacity, count,
                                                  list);
        });
    if (std::find(modes.begin(), modes.end(), blend_mode_) == modes.end() && !modes.empty())
      blend_mode_ = modes.front();
  } catch (...) {
    xrDestroySession(session_);
    throw;
  }
}

XrViewSession::~XrViewSession() { xrDestroySession(session_); }

void XrViewSession::create(const GlContext& context) {
  PFN_xrGetOpenGLGraphicsRequirementsKHR get_requirements = nullptr;
  check_xr(xrGetInstanceProcAddr(system_.instance(), "xrGetOpenGLGraphicsRequirementsKHR",
                                 reinterpret_cast<PFN_xrVoidFunction*>(&get_requirements)),
           "xrGetInstanceProcAddr");
  auto requirements = xr_struct<XrGraphicsRequirementsOpenGLKHR>(XR_TYPE_GRAPHICS_REQUIREMENTS_OPENGL_KHR);
  check_xr(get_requirements(system_.instance(), system_.id(), &requirements),
           "xrGetOpenGLGraphicsRequirementsKHR");
  if (requirements.minApiVersionSupported > XR_MAKE_VERSION(4, 5, 0))
    throw Error("the OpenXR runtime needs an OpenGL newer than 4.5");
  auto binding = xr_struct<XrGraphicsBindingEGLMNDX>(XR_TYPE_GRAPHICS_BINDING_EGL_MNDX);
  binding.getProcAddress = eglGetProcAddress;
  binding.display = context.display();
  binding.context = context.context();
  binding.config = config_of(binding.display, binding.context);
  auto made = xr_struct<XrSessionCreateInfo>(XR_TYPE_SESSION_CREATE_INFO);
  made.next = &binding;
  made.systemId = system_.id();
  check_xr(xrCreateSession(system_.instance(), &made, &session_), "xrCreateSession");
}

void XrViewSession::find_room() {
  const auto spaces = xr_list<XrReferenceSpaceType>(
      "xrEnumerateReferenceSpaces", XR_REFERENCE_SPACE_TYPE_LOCAL,
      [&](std::uint32_t capacity, std::uint32_t* count, XrReferenceSpaceType* list) {
        return xrEnumerateReferenceSpaces(session_, capacity, count, list);
      });
  knows_floor_ = std::find(spaces.begin(), spaces.end(), XR_REFERENCE_SPACE_TYPE_STAGE) != spaces.end();
  auto made = xr_struct<XrReferenceSpaceCreateInfo>(XR_TYPE_REFERENCE_SPACE_CREATE_INFO);
  made.referenceSpaceType = knows_floor_ ? XR_REFERENCE_SPACE_TYPE_STAGE : XR_REFERENCE_SPACE_TYPE_LOCAL;
  made.poseInReferenceSpace.orientation.w = 1;
  check_xr(xrCreateReferenceSpace(session_, &made, &room_), "xrCreateReferenceSpace");
}

void XrViewSession::poll() {
  for (;;) {
    auto event = xr_struct<XrEventDataBuffer>(XR_TYPE_EVENT_DATA_BUFFER);
    const XrResult result = xrPollEvent(system_.instance(), &event);
    check_xr(result, "xrPollEvent");
    if (result == XR_EVENT_UNAVAILABLE) return;
    if (event.type == XR_TYPE_EVENT_DATA_INSTANCE_LOSS_PENDING)
      check_xr(XR_ERROR_INSTANCE_LOST, "xrPollEvent");
    if (event.type == XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED) {
      XrEventDataSessionStateChanged changed{};
      std::memcpy(&changed, &event, sizeof changed);
      if (changed.session == session_) follow(changed.state);
    }
  }
}

void XrViewSession::follow(XrSessionState state) {
  state_ = state;
  if (state == XR_SESSION_STATE_READY) {
    auto begun = xr_struct<XrSessionBeginInfo>(XR_TYPE_SESSION_BEGIN_INFO);
    begun.primaryViewConfigurationType = kStereo;
    check_xr(xrBeginSession(session_, &begun), "xrBeginSession");
    is_running_ = true;
  }
  if (state == XR_SESSION_STATE_STOPPING) {
    is_running_ = false;
    check_xr(xrEndSession(session_), "xrEndSession");
  }
  if (state == XR_SESSION_STATE_EXITING) is_over_ = true;
  if (state == XR_SESSION_STATE_LOSS_PENDING) check_xr(XR_ERROR_SESSION_LOST, "xrPollEvent");
}

bool XrViewSession::request_exit() {
  if (!is_running_) return false;
  check_xr(xrRequestExitSession(session_), "xrRequestExitSession");
  return true;
}

}  // namespace tactus
