#include "tactus/xr/xr_calls.h"

#include <openxr/openxr_reflection.h>

#include <string>

#include "tactus/base/error.h"

namespace tactus {
namespace {

std::string name_of(XrResult result) {
#define TACTUS_XR_NAME(name, value) \
  if (static_cast<int>(result) == (value)) return #name;
  XR_LIST_ENUM_XrResult(TACTUS_XR_NAME)
#undef TACTUS_XR_NAME
          return "error " +
      std::to_string(static_cast<int>(result));
}

}  // namespace

void check_xr(XrResult result, const char* call) {
  if (XR_SUCCEEDED(result)) return;
  const std::string name = name_of(result);
  if (result == XR_ERROR_SESSION_LOST || result == XR_ERROR_INSTANCE_LOST)
    throw Error("the headset is lost (" + name +
                "): see that it is connected and its runtime runs, then start again");
  if (result == XR_ERROR_RUNTIME_UNAVAILABLE || result == XR_ERROR_FILE_ACCESS_ERROR ||
      result == XR_ERROR_FILE_CONTENTS_INVALID)
    throw Error("no OpenXR runtime answers (" + name +
                "): start the one of your headset, Monado say, or name its manifest in XR_RUNTIME_JSON");
  if (result == XR_ERROR_FORM_FACTOR_UNAVAILABLE)
    throw Error("the OpenXR runtime finds no headset (" + name +
                "): connect it, switch it on, then start again");
  throw Error(std::string("OpenXR: ") + call + " failed: " + name);
}

Rigidd to_rigid(const XrPosef& pose) {
  const Quat<double> q = normalized(
      Quat<double>{pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z});
  return {rotation_matrix(q), {pose.position.x, pose.position.y, pose.position.z}};
}

bool is_tracked(XrSpaceLocationFlags flags) {
  constexpr XrSpaceLocationFlags kAll =
      XR_SPACE_LOCATION_POSITION_VALID_BIT | XR_SPACE_LOCATION_ORIENTATION_VALID_BIT |
      XR_SPACE_LOCATION_POSITION_TRACKED_BIT | XR_SPACE_LOCATION_ORIENTATION_TRACKED_BIT;
  return (flags & kAll) == kAll;
}

}  // namespace tactus
