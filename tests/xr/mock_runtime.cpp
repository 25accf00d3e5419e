#include "xr/mock_runtime.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#define XR_USE_GRAPHICS_API_OPENGL
#define XR_USE_PLATFORM_EGL
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <map>
#include <thread>

namespace {

using tactus::mock::EyePicture;
using tactus::mock::Runtime;

// The loader's interface (OpenXR specification, chapter "Runtime interface negotiation").
struct NegotiateLoaderInfo {
  std::uint32_t struct_type, struct_version;
  std::size_t struct_size;
  std::uint32_t min_interface_version, max_interface_version;
  XrVersion min_api_version, max_api_version;
};
struct NegotiateRuntimeRequest {
  std::uint32_t struct_type, struct_version;
  std::size_t struct_size;
  std::uint32_t runtime_interface_version;
  XrVersion runtime_api_version;
  PFN_xrGetInstanceProcAddr get_instance_proc_addr;
};

constexpr std::uint32_t kSide_px = 400;
constexpr auto kPeriod = std::chrono::milliseconds(8);
constexpr std::size_t kImages = 3;

struct Chain {
  std::int64_t format = 0;
  std::array<GLuint, kImages> textures{};
  std::size_t next = 0, released = kImages;
  bool is_acquired = false, is_waited = false;
};

struct Space {
  int hand = -1;  ///< -1: the room
};

/// All of a session; there is one at a time.
struct Session {
  bool is_begun = false, is_ending = false, frame_is_begun = false;
  XrSessionState state = XR_SESSION_STATE_UNKNOWN;
  std::deque<XrSessionState> events;
  XrTime predicted = 0;
  std::deque<Chain> chains;  ///< stay where they are
  std::deque<Space> spaces;
};

Session session;
std::map<std::string, XrPath> paths;

Runtime& runtime() { return *tactus_mock_runtime(); }
void fault(const std::string& text) { runtime().record.faults.push_back(text); }

template <class T>
T handle(std::uintptr_t value) {
  return reinterpret_cast<T>(value);
}
template <class T>
T& object(void* value) {
  return *static_cast<T*>(value);
}

/// OpenXR's idiom of two calls.
template <class T>
XrResult list(const std::vector<T>& all, std::uint32_t capacity, std::uint32_t* count, T* out) {
  *count = static_cast<std::uint32_t>(all.size());
  if (capacity == 0) return XR_SUCCESS;
  if (capacity < all.size()) return XR_ERROR_SIZE_INSUFFICIENT;
  std::copy(all.begin(), all.end(), out);
  return XR_SUCCESS;
}

bool is_lost() {
  const auto& [script, record] = runtime();
  return script.lose_after > 0 && record.frames >= script.lose_after;
}

void go_to(XrSessionState state) { session.events.push_back(state); }

XrPosef to_xr(const tactus::mock::Pose& p) {
  return {{p.orientation[0], p.orientation[1], p.orientation[2], p.orientation[3]},
          {p.position_m[0], p.position_m[1], p.position_m[2]}};
}

XRAPI_ATTR XrResult XRAPI_CALL enumerate_extensions(const char* /*layer*/, std::uint32_t capacity,
                                                    std::uint32_t* count, XrExtensionProperties* out) {
  std::vector<const char*> names{"XR_KHR_opengl_enable"};
  if (runtime().script.offers_egl) names.push_back("XR_MNDX_egl_enable");
  if (runtime().script.offers_depth) names.push_back("XR_KHR_composition_layer_depth");
  *count = static_cast<std::uint32_t>(names.size());
  if (capacity == 0) return XR_SUCCESS;
  for (std::size_t i = 0; i < names.size(); ++i) {
    std::snprintf(out[i].extensionName, sizeof out[i].extensionName, "%s", names[i]);
    out[i].extensionVersion = 1;
  }
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL create_instance(const XrInstanceCreateInfo* /*info*/, XrInstance* instance) {
  session = {};
  *instance = handle<XrInstance>(1);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL destroy_instance(XrInstance /*instance*/) { return XR_SUCCESS; }
XRAPI_ATTR XrResult XRAPI_CALL get_instance_properties(XrInstance /*i*/, XrInstanceProperties* out) {
  std::snprintf(out->runtimeName, sizeof out->runtimeName, "mock");
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL get_system(XrInstance /*i*/, const XrSystemGetInfo* /*info*/, XrSystemId* id) {
  if (!runtime().script.has_headset) return XR_ERROR_FORM_FACTOR_UNAVAILABLE;
  *id = 1;
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL get_system_properties(XrInstance /*i*/, XrSystemId /*id*/,
                                                     XrSystemProperties* out) {
  std::snprintf(out->systemName, sizeof out->systemName, "test headset");
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL get_requirements(XrInstance /*i*/, XrSystemId /*id*/,
                                                XrGraphicsRequirementsOpenGLKHR* out) {
  out->minApiVersionSupported = XR_MAKE_VERSION(4, 3, 0);
  out->maxApiVersionSupported = XR_MAKE_VERSION(4, 6, 0);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL enumerate_blend_modes(XrInstance /*i*/, XrSystemId /*id*/,
                                                     XrViewConfigurationType /*type*/, std::uint32_t capacity,
                                                     std::uint32_t* count, XrEnvironmentBlendMode* out) {
  return list<XrEnvironmentBlendMode>({XR_ENVIRONMENT_BLEND_MODE_OPAQUE}, capacity, count, out);
}
XRAPI_ATTR XrResult XRAPI_CALL enumerate_views(XrInstance /*i*/, XrSystemId /*id*/,
                                               XrViewConfigurationType /*type*/, std::uint32_t capacity,
                                               std::uint32_t* count, XrViewConfigurationView* out) {
  const XrViewConfigurationView view{
      XR_TYPE_VIEW_CONFIGURATION_VIEW, nullptr, kSide_px, kSide_px, kSide_px, kSide_px, 1, 1};
  return list<XrViewConfigurationView>({view, view}, capacity, count, out);
}

XRAPI_ATTR XrResult XRAPI_CALL create_session(XrInstance /*i*/, const XrSessionCreateInfo* info,
                                              XrSession* out) {
  const auto* binding = static_cast<const XrGraphicsBindingEGLMNDX*>(info->next);
  if (binding == nullptr || binding->type != XR_TYPE_GRAPHICS_BINDING_EGL_MNDX ||
      binding->context != eglGetCurrentContext() || binding->config == nullptr)
    return XR_ERROR_GRAPHICS_DEVICE_INVALID;
  *out = handle<XrSession>(2);
  go_to(XR_SESSION_STATE_IDLE);
  go_to(XR_SESSION_STATE_READY);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL destroy_session(XrSession /*s*/) { return XR_SUCCESS; }
XRAPI_ATTR XrResult XRAPI_CALL poll_event(XrInstance /*i*/, XrEventDataBuffer* out) {
  if (session.events.empty()) return XR_EVENT_UNAVAILABLE;
  session.state = session.events.front();
  session.events.pop_front();
  const XrEventDataSessionStateChanged event{XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED, nullptr,
                                             handle<XrSession>(2), session.state, session.predicted};
  std::memcpy(out, &event, sizeof event);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL begin_session(XrSession /*s*/, const XrSessionBeginInfo* info) {
  if (session.state != XR_SESSION_STATE_READY) return XR_ERROR_SESSION_NOT_READY;
  if (info->primaryViewConfigurationType != XR_VIEW_CONFIGURATION_TYPE_PRIMARY_STEREO) fault("not stereo");
  session.is_begun = true;
  for (const auto s : {XR_SESSION_STATE_SYNCHRONIZED, XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED})
    go_to(s);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL end_session(XrSession /*s*/) {
  if (session.state != XR_SESSION_STATE_STOPPING) return XR_ERROR_SESSION_NOT_STOPPING;
  session.is_begun = false;
  go_to(XR_SESSION_STATE_IDLE);
  go_to(XR_SESSION_STATE_EXITING);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL request_exit(XrSession /*s*/) {
  if (!session.is_ending) go_to(XR_SESSION_STATE_STOPPING);
  session.is_ending = true;
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL enumerate_spaces(XrSession /*s*/, std::uint32_t capacity, std::uint32_t* count,
                                                XrReferenceSpaceType* out) {
  std::vector<XrReferenceSpaceType> all{XR_REFERENCE_SPACE_TYPE_VIEW, XR_REFERENCE_SPACE_TYPE_LOCAL};
  if (runtime().script.knows_floor) all.push_back(XR_REFERENCE_SPACE_TYPE_STAGE);
  return list(all, capacity, count, out);
}
XRAPI_ATTR XrResult XRAPI_CALL create_reference_space(XrSession /*s*/, const XrReferenceSpaceCreateInfo* info,
                                                      XrSpace* out) {
  if (info->poseInReferenceSpace.orientation.w != 1) return XR_ERROR_POSE_INVALID;
  *out = reinterpret_cast<XrSpace>(&session.spaces.emplace_back());
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL create_action_space(XrSession /*s*/, const XrActionSpaceCreateInfo* info,
                                                   XrSpace* out) {
  if (info->poseInActionSpace.orientation.w != 1) return XR_ERROR_POSE_INVALID;
  session.spaces.push_back({info->subactionPath == paths["/user/hand/left"] ? 0 : 1});
  *out = reinterpret_cast<XrSpace>(&session.spaces.back());
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL locate_space(XrSpace space, XrSpace base, XrTime time, XrSpaceLocation* out) {
  if (object<Space>(base).hand >= 0) fault("a hand isn't located in the room");
  if (time != session.predicted) fault("a hand is located at another time than the picture's");
  const int hand = object<Space>(space).hand;
  if (hand < 0) return XR_ERROR_HANDLE_INVALID;
  const auto& held = runtime().script.hands.at(static_cast<std::size_t>(hand));
  out->locationFlags = held.is_tracked ? 15 : 0;
  if (held.is_tracked) out->pose = to_xr(held.pose);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL string_to_path(XrInstance /*i*/, const char* text, XrPath* out) {
  *out = paths.emplace(text, paths.size() + 1).first->second;
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL create_action_set(XrInstance /*i*/, const XrActionSetCreateInfo* /*info*/,
                                                 XrActionSet* out) {
  *out = handle<XrActionSet>(3);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL create_action(XrActionSet /*set*/, const XrActionCreateInfo* info,
                                             XrAction* out) {
  *out = handle<XrAction>(info->actionType == XR_ACTION_TYPE_POSE_INPUT ? 4 : 5);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL suggest_bindings(XrInstance /*i*/,
                                                const XrInteractionProfileSuggestedBinding* info) {
  return info->countSuggestedBindings == 4 ? XR_SUCCESS : XR_ERROR_PATH_UNSUPPORTED;
}
XRAPI_ATTR XrResult XRAPI_CALL attach_action_sets(XrSession /*s*/,
                                                  const XrSessionActionSetsAttachInfo* /*info*/) {
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL sync_actions(XrSession /*s*/, const XrActionsSyncInfo* /*info*/) {
  return session.state == XR_SESSION_STATE_FOCUSED ? XR_SUCCESS : XR_SESSION_NOT_FOCUSED;
}
XRAPI_ATTR XrResult XRAPI_CALL get_action_state_boolean(XrSession /*s*/, const XrActionStateGetInfo* info,
                                                        XrActionStateBoolean* out) {
  const std::size_t hand = info->subactionPath == paths["/user/hand/left"] ? 0 : 1;
  out->isActive = XR_TRUE;
  out->currentState = runtime().script.hands.at(hand).pulls_trigger ? XR_TRUE : XR_FALSE;
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL enumerate_formats(XrSession /*s*/, std::uint32_t capacity,
                                                 std::uint32_t* count, std::int64_t* out) {
  return list<std::int64_t>({GL_SRGB8_ALPHA8, GL_RGBA8, GL_DEPTH_COMPONENT32F}, capacity, count, out);
}
XRAPI_ATTR XrResult XRAPI_CALL create_swapchain(XrSession /*s*/, const XrSwapchainCreateInfo* info,
                                                XrSwapchain* out) {
  Chain& chain = session.chains.emplace_back();
  chain.format = info->format;
  for (GLuint& texture : chain.textures) {
    glCreateTextures(GL_TEXTURE_2D, 1, &texture);
    glTextureStorage2D(texture, 1, static_cast<GLenum>(info->format), static_cast<GLsizei>(info->width),
                       static_cast<GLsizei>(info->height));
  }
  *out = reinterpret_cast<XrSwapchain>(&chain);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL enumerate_images(XrSwapchain chain, std::uint32_t capacity,
                                                std::uint32_t* count, XrSwapchainImageBaseHeader* out) {
  *count = kImages;
  if (capacity == 0) return XR_SUCCESS;
  auto* images = reinterpret_cast<XrSwapchainImageOpenGLKHR*>(out);
  for (std::size_t i = 0; i < kImages; ++i) images[i].image = object<Chain>(chain).textures.at(i);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL acquire_image(XrSwapchain handle, const XrSwapchainImageAcquireInfo* /*info*/,
                                             std::uint32_t* index) {
  auto& chain = object<Chain>(handle);
  if (chain.is_acquired) return XR_ERROR_CALL_ORDER_INVALID;
  chain.is_acquired = true;
  *index = static_cast<std::uint32_t>(chain.next);
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL wait_image(XrSwapchain handle, const XrSwapchainImageWaitInfo* /*info*/) {
  auto& chain = object<Chain>(handle);
  if (!chain.is_acquired) return XR_ERROR_CALL_ORDER_INVALID;
  chain.is_waited = true;
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL release_image(XrSwapchain handle,
                                             const XrSwapchainImageReleaseInfo* /*info*/) {
  auto& chain = object<Chain>(handle);
  if (!chain.is_waited) return XR_ERROR_CALL_ORDER_INVALID;
  chain.is_acquired = chain.is_waited = false;
  chain.released = chain.next;
  chain.next = (chain.next + 1) % kImages;
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL wait_frame(XrSession /*s*/, const XrFrameWaitInfo* /*info*/,
                                          XrFrameState* out) {
  if (!session.is_begun) return XR_ERROR_SESSION_NOT_RUNNING;
  if (is_lost()) return XR_ERROR_SESSION_LOST;
  std::this_thread::sleep_for(kPeriod);
  auto& [script, record] = runtime();
  if (script.before_frame) script.before_frame(record.frames + 1);
  using std::chrono::nanoseconds;
  session.predicted =
      std::chrono::steady_clock::now().time_since_epoch() / nanoseconds(1) + 2 * nanoseconds(kPeriod).count();
  out->predictedDisplayTime = session.predicted;
  out->predictedDisplayPeriod = nanoseconds(kPeriod).count();
  out->shouldRender = session.state >= XR_SESSION_STATE_VISIBLE ? XR_TRUE : XR_FALSE;
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL begin_frame(XrSession /*s*/, const XrFrameBeginInfo* /*info*/) {
  session.frame_is_begun = true;
  return XR_SUCCESS;
}
XRAPI_ATTR XrResult XRAPI_CALL locate_views(XrSession /*s*/, const XrViewLocateInfo* info, XrViewState* state,
                                            std::uint32_t capacity, std::uint32_t* count, XrView* out) {
  if (info->displayTime != session.predicted) fault("eyes are located at another time than the picture's");
  *count = 2;
  if (capacity < 2) return XR_ERROR_SIZE_INSUFFICIENT;
  const auto& script = runtime().script;
  for (std::size_t i = 0; i < 2; ++i) {
    out[i].pose = to_xr(script.head);
    out[i].pose.position.x += (i == 0 ? -0.5F : 0.5F) * script.ipd_m;
    const auto& e = script.edges.at(i);
    out[i].fov = {std::atan(e.left), std::atan(e.right), std::atan(e.up), std::atan(e.down)};
  }
  state->viewStateFlags = 15;
  return XR_SUCCESS;
}

/// Copies the images of a view.
void keep(const XrCompositionLayerProjectionView& view, EyePicture& picture) {
  const auto& color = object<Chain>(view.subImage.swapchain);
  if (color.is_acquired || color.released == kImages) return fault("colours weren't released");
  picture.width_px = view.subImage.imageRect.extent.width;
  picture.height_px = view.subImage.imageRect.extent.height;
  const std::size_t pixels =
      static_cast<std::size_t>(picture.width_px) * static_cast<std::size_t>(picture.height_px);
  picture.rgba.resize(4 * pixels);
  glGetTextureImage(color.textures.at(color.released), 0, GL_RGBA, GL_UNSIGNED_BYTE,
                    static_cast<GLsizei>(picture.rgba.size()), picture.rgba.data());
  picture.depth.clear();
  const auto* info = static_cast<const XrCompositionLayerDepthInfoKHR*>(view.next);
  if (info == nullptr || info->type != XR_TYPE_COMPOSITION_LAYER_DEPTH_INFO_KHR) return;
  const auto& depth = object<Chain>(info->subImage.swapchain);
  if (depth.is_acquired || depth.released == kImages) return fault("depths weren't released");
  if (info->minDepth != 0 || info->maxDepth != 1) fault("depths aren't from 0 to 1");
  picture.near_m = info->nearZ;
  picture.far_m = info->farZ;
  picture.depth.resize(pixels);
  glGetTextureImage(depth.textures.at(depth.released), 0, GL_DEPTH_COMPONENT, GL_FLOAT,
                    static_cast<GLsizei>(pixels * sizeof(float)), picture.depth.data());
}

XRAPI_ATTR XrResult XRAPI_CALL end_frame(XrSession /*s*/, const XrFrameEndInfo* info) {
  if (!session.frame_is_begun) return XR_ERROR_CALL_ORDER_INVALID;
  session.frame_is_begun = false;
  if (info->displayTime != session.predicted) return XR_ERROR_TIME_INVALID;
  if (info->layerCount == 0) return XR_SUCCESS;
  auto& [script, record] = runtime();
  const auto* layer = reinterpret_cast<const XrCompositionLayerProjection*>(info->layers[0]);
  if (layer->type != XR_TYPE_COMPOSITION_LAYER_PROJECTION || layer->viewCount != 2)
    return XR_ERROR_LAYER_INVALID;
  for (std::size_t i = 0; i < 2; ++i) keep(layer->views[i], record.eyes.at(i));
  ++record.frames;
  if (session.state == XR_SESSION_STATE_FOCUSED) ++record.focused_frames;
  if (script.warn_after == record.frames) go_to(XR_SESSION_STATE_LOSS_PENDING);
  if (record.frames >= script.end_after) request_exit(nullptr);
  return XR_SUCCESS;
}

XRAPI_ATTR XrResult XRAPI_CALL get_instance_proc_addr(XrInstance instance, const char* name,
                                                      PFN_xrVoidFunction* out);

const std::map<std::string, PFN_xrVoidFunction>& functions() {
  const auto as = [](auto* f) { return reinterpret_cast<PFN_xrVoidFunction>(f); };
  static const std::map<std::string, PFN_xrVoidFunction> all{
      {"xrGetInstanceProcAddr", as(get_instance_proc_addr)},
      {"xrEnumerateInstanceExtensionProperties", as(enumerate_extensions)},
      {"xrCreateInstance", as(create_instance)},
      {"xrDestroyInstance", as(destroy_instance)},
      {"xrGetInstanceProperties", as(get_instance_properties)},
      {"xrGetSystem", as(get_system)},
      {"xrGetSystemProperties", as(get_system_properties)},
      {"xrGetOpenGLGraphicsRequirementsKHR", as(get_requirements)},
      {"xrEnumerateEnvironmentBlendModes", as(enumerate_blend_modes)},
      {"xrEnumerateViewConfigurationViews", as(enumerate_views)},
      {"xrCreateSession", as(create_session)},
      {"xrDestroySession", as(destroy_session)},
      {"xrPollEvent", as(poll_event)},
      {"xrBeginSession", as(begin_session)},
      {"xrEndSession", as(end_session)},
      {"xrRequestExitSession", as(request_exit)},
      {"xrEnumerateReferenceSpaces", as(enumerate_spaces)},
      {"xrCreateReferenceSpace", as(create_reference_space)},
      {"xrCreateActionSpace", as(create_action_space)},
      {"xrLocateSpace", as(locate_space)},
      {"xrStringToPath", as(string_to_path)},
      {"xrCreateActionSet", as(create_action_set)},
      {"xrCreateAction", as(create_action)},
      {"xrSuggestInteractionProfileBindings", as(suggest_bindings)},
      {"xrAttachSessionActionSets", as(attach_action_sets)},
      {"xrSyncActions", as(sync_actions)},
      {"xrGetActionStateBoolean", as(get_action_state_boolean)},
      {"xrEnumerateSwapchainFormats", as(enumerate_formats)},
      {"xrCreateSwapchain", as(create_swapchain)},
      {"xrEnumerateSwapchainImages", as(enumerate_images)},
      {"xrAcquireSwapchainImage", as(acquire_image)},
      {"xrWaitSwapchainImage", as(wait_image)},
      {"xrReleaseSwapchainImage", as(release_image)},
      {"xrWaitFrame", as(wait_frame)},
      {"xrBeginFrame", as(begin_frame)},
      {"xrLocateViews", as(locate_views)},
      {"xrEndFrame", as(end_frame)},
  };
  return all;
}

XRAPI_ATTR XrResult XRAPI_CALL get_instance_proc_addr(XrInstance /*i*/, const char* name,
                                                      PFN_xrVoidFunction* out) {
  const auto found = functions().find(name);
  *out = found == functions().end() ? nullptr : found->second;
  return *out == nullptr ? XR_ERROR_FUNCTION_UNSUPPORTED : XR_SUCCESS;
}

/// A number of the environment, for programs that know nothing of the mock.
int from_environment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::atoi(text);
}

}  // namespace

extern "C" Runtime* tactus_mock_runtime() {
  static Runtime made = [] {
    Runtime first;
    first.script.end_after = from_environment("MOCK_XR_END_AFTER", first.script.end_after);
    first.script.lose_after = from_environment("MOCK_XR_LOSE_AFTER", 0);
    first.script.has_headset = from_environment("MOCK_XR_HAS_HEADSET", 1) != 0;
    return first;
  }();
  return &made;
}

extern "C" XrResult xrNegotiateLoaderRuntimeInterface(const NegotiateLoaderInfo* info,
                                                      NegotiateRuntimeRequest* request) {
  if (info->min_interface_version > 1) return XR_ERROR_INITIALIZATION_FAILED;
  request->runtime_interface_version = 1;
  request->runtime_api_version = XR_MAKE_VERSION(1, 0, 20);
  request->get_instance_proc_addr = get_instance_proc_addr;
  return XR_SUCCESS;
}
