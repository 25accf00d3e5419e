#pragma once
/// Instance, system and session of OpenXR, and the session's states. Internal to xr/.
#include <string>

#include "tactus/view/gl_context.h"
#include "tactus/xr/xr_calls.h"

namespace tactus {

/// A connection to the runtime and the headset that it has.
class XrSystem {
 public:
  /// @throws Error when there is no runtime, no headset, or the runtime draws with something else.
  XrSystem();
  ~XrSystem();
  XrSystem(const XrSystem&) = delete;
  XrSystem& operator=(const XrSystem&) = delete;

  XrInstance instance() const { return instance_; }
  XrSystemId id() const { return id_; }
  /// Runtime and headset, for people.
  const std::string& description() const { return description_; }
  bool takes_depth() const { return takes_depth_; }
  bool knows_bare_hands() const { return knows_bare_hands_; }
  XrPath path(const std::string& text) const;

 private:
  void create();

  XrInstance instance_ = XR_NULL_HANDLE;
  XrSystemId id_ = XR_NULL_SYSTEM_ID;
  std::string runtime_, description_;
  bool takes_depth_ = false, knows_bare_hands_ = false;
};

/// A session that draws with an EGL context, and its space: the floor of the room, +Y up.
class XrViewSession {
 public:
  /// Keeps a reference to the system.
  XrViewSession(const XrSystem& system, const GlContext& context);
  ~XrViewSession();
  XrViewSession(const XrViewSession&) = delete;
  XrViewSession& operator=(const XrViewSession&) = delete;

  /// Takes the runtime's events; begins and ends the session when it asks. @throws Error when it is lost.
  void poll();
  bool is_running() const { return is_running_; }  ///< frames may be waited for
  bool has_input() const { return state_ == XR_SESSION_STATE_FOCUSED; }
  bool is_over() const { return is_over_; }  ///< the runtime, or the one who wears it, ended it
  /// Asks the runtime to end it. @returns false where it doesn't run: the caller just leaves.
  bool request_exit();

  XrSession get() const { return session_; }
  XrSpace room() const { return room_; }
  /// Whether the room's origin is its floor; else it is where the head was.
  bool knows_floor() const { return knows_floor_; }
  XrEnvironmentBlendMode blend_mode() const { return blend_mode_; }

 private:
  void create(const GlContext& context);
  void find_room();
  void follow(XrSessionState state);

  const XrSystem& system_;
  XrSession session_ = XR_NULL_HANDLE;
  XrSpace room_ = XR_NULL_HANDLE;
  XrSessionState state_ = XR_SESSION_STATE_UNKNOWN;
  XrEnvironmentBlendMode blend_mode_ = XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
  bool knows_floor_ = true, is_running_ = false, is_over_ = false;
};

}  // namespace tactus
