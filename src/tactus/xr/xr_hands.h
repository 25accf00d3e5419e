#pragma once
/// Controllers, and bare hands where the runtime knows them. Internal to xr/.
#include <array>

#include "tactus/xr/held_tools.h"
#include "tactus/xr/xr_session.h"

namespace tactus {

class XrHands {
 public:
  /// Attaches its actions to the session. Keeps references.
  XrHands(const XrSystem& system, const XrViewSession& session);

  using Poses = std::array<HandPose, HeldTools::kHands>;
  /// Left and right, in the room, when a picture of that time is seen.
  Poses look(XrTime seen_at);

 private:
  void create_actions(const XrSystem& system);
  void suggest(const XrSystem& system, const char* profile, const char* take) const;
  bool takes(std::size_t hand) const;

  const XrViewSession& session_;
  XrActionSet set_ = XR_NULL_HANDLE;
  XrAction grip_ = XR_NULL_HANDLE, take_ = XR_NULL_HANDLE;
  std::array<XrPath, HeldTools::kHands> paths_{};
  std::array<XrSpace, HeldTools::kHands> spaces_{};
};

}  // namespace tactus
