#pragma once
/// OpenXR's headers, and errors of its calls. Internal to xr/.
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#define XR_USE_GRAPHICS_API_OPENGL
#define XR_USE_PLATFORM_EGL
#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

/// @throws Error when the call failed. `call` is its name.
void check_xr(XrResult result, const char* call);

/// A structure of OpenXR with its type.
template <class T>
T xr_struct(XrStructureType type) {
  T made{};
  made.type = type;
  return made;
}

/// The elements of OpenXR's idiom of two calls: first their number, then the elements.
/// @param fill (capacity, count, elements) -> XrResult
template <class T, class Fill>
std::vector<T> xr_list(const char* call, T element, const Fill& fill) {
  std::uint32_t count = 0;
  check_xr(fill(0, &count, nullptr), call);
  std::vector<T> list(count, element);
  if (count > 0) check_xr(fill(count, &count, list.data()), call);
  list.resize(count);
  return list;
}

Rigidd to_rigid(const XrPosef& pose);
/// Whether both parts of a pose are valid and tracked now.
bool is_tracked(XrSpaceLocationFlags flags);

}  // namespace tactus
