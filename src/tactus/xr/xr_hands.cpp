#include "tactus/xr/xr_hands.h"

#include <cstdio>
#include <string>

namespace tactus {
namespace {

constexpr std::array<const char*, HeldTools::kHands> kUserPaths{"/user/hand/left", "/user/hand/right"};

/// A profile of controllers, and the input that is pulled or pinched there.
struct Profile {
  const char* name;
  const char* take;
};
constexpr std::array kProfiles{
    Profile{"/interaction_profiles/khr/simple_controller", "/input/select/click"},
    Profile{"/interaction_profiles/oculus/touch_controller", "/input/trigger/value"},
    Profile{"/interaction_profiles/valve/index_controller", "/input/trigger/value"},
    Profile{"/interaction_profiles/htc/vive_controller", "/input/trigger/value"},
    Profile{"/interaction_profiles/microsoft/motion_controller", "/input/trigger/value"},
};
constexpr Profile kBareHands{"/interaction_profiles/microsoft/hand_interaction", "/input/select/value"};

XrAction create_action(XrActionSet set, XrActionType type, const char* name, const char* for_people,
                       std::array<XrPath, HeldTools::kHands>& hands) {
  auto made = xr_struct<XrActionCreateInfo>(XR_TYPE_ACTION_CREATE_INFO);
  std::snprintf(made.actionName, XR_MAX_ACTION_NAME_SIZE, "%s", name);
  std::snprintf(made.localizedActionName, XR_MAX_LOCALIZED_ACTION_NAME_SIZE, "%s", for_people);
  made.actionType = type;
  made.countSubactionPaths = static_cast<std::uint32_t>(hands.size());
  made.subactionPaths = hands.data();
  XrAction action = XR_NULL_HANDLE;
  check_xr(xrCreateAction(set, &made, &action), "xrCreateAction");
  return action;
}

}  // namespace

XrHands::XrHands(const XrSystem& system, const XrViewSession& session) : session_(session) {
  create_actions(system);
  for (const Profile& profile : kProfiles) suggest(system, profile.name, profile.take);
  if (system.knows_bare_hands()) suggest(system, kBareHands.name, kBareHands.take);
  for (std::size_t hand = 0; hand < spaces_.size(); ++hand) {
    auto made = xr_struct<XrActionSpaceCreateInfo>(XR_TYPE_ACTION_SPACE_CREATE_INFO);
    made.action = grip_;
    made.subactionPath = paths_.at(hand);
    made.poseInActionSpace.orientation.w = 1;
    check_xr(xrCreateActionSpace(session.get(), &made, &spaces_.at(hand)), "xrCreateActionSpace");
  }
  auto attached = xr_struct<XrSessionActionSetsAttachInfo>(XR_TYPE_SESSION_ACTION_SETS_ATTACH_INFO);
  attached.countActionSets = 1;
  attached.actionSets = &set_;
  check_xr(xrAttachSessionActionSets(session.get(), &attached), "xrAttachSessionActionSets");
}

void XrHands::create_actions(const XrSystem& system) {
  for (std::size_t hand = 0; hand < paths_.size(); ++hand) paths_.at(hand) = system.path(kUserPaths.at(hand));
  auto made = xr_struct<XrActionSetCreateInfo>(XR_TYPE_ACTION_SET_CREATE_INFO);
  std::snprintf(made.actionSetName, XR_MAX_ACTION_SET_NAME_SIZE, "tools");
  std::snprintf(made.localizedActionSetName, XR_MAX_LOCALIZED_ACTION_SET_NAME_SIZE, "Tools");
  check_xr(xrCreateActionSet(system.instance(), &made, &set_), "xrCreateActionSet");
  grip_ = create_action(set_, XR_ACTION_TYPE_POSE_INPUT, "grip", "Where the hand is", paths_);
  take_ = create_action(set_, XR_ACTION_TYPE_BOOLEAN_INPUT, "take", "Hold a tool", paths_);
}

void XrHands::suggest(const XrSystem& system, const char* profile, const char* take) const {
  std::vector<XrActionSuggestedBinding> bindings;
  for (const char* user : kUserPaths) {
    bindings.push_back({grip_, system.path(std::string(user) + "/input/grip/pose")});
    bindings.push_back({take_, system.path(std::string(user) + take)});
  }
  auto suggested =
      xr_struct<XrInteractionProfileSuggestedBinding>(XR_TYPE_INTERACTION_PROFILE_SUGGESTED_BINDING);
  suggested.interactionProfile = system.path(profile);
  suggested.countSuggestedBindings = static_cast<std::uint32_t>(bindings.size());
  suggested.suggestedBindings = bindings.data();
  // A runtime may not know a profile: then nobody has that controller.
  const XrResult result = xrSuggestInteractionProfileBindings(system.instance(), &suggested);
  if (result != XR_ERROR_PATH_UNSUPPORTED) check_xr(result, "xrSuggestInteractionProfileBindings");
}

bool XrHands::takes(std::size_t hand) const {
  auto asked = xr_struct<XrActionStateGetInfo>(XR_TYPE_ACTION_STATE_GET_INFO);
  asked.action = take_;
  asked.subactionPath = paths_.at(hand);
  auto state = xr_struct<XrActionStateBoolean>(XR_TYPE_ACTION_STATE_BOOLEAN);
  check_xr(xrGetActionStateBoolean(session_.get(), &asked, &state), "xrGetActionStateBoolean");
  return state.isActive == XR_TRUE && state.currentState == XR_TRUE;
}

XrHands::Poses XrHands::look(XrTime seen_at) {
  Poses poses;
  const XrActiveActionSet active{set_, XR_NULL_PATH};
  auto sync = xr_struct<XrActionsSyncInfo>(XR_TYPE_ACTIONS_SYNC_INFO);
  sync.countActiveActionSets = 1;
  sync.activeActionSets = &active;
  const XrResult result = xrSyncActions(session_.get(), &sync);
  check_xr(result, "xrSyncActions");
  if (result == XR_SESSION_NOT_FOCUSED) return poses;
  for (std::size_t hand = 0; hand < poses.size(); ++hand) {
    auto location = xr_struct<XrSpaceLocation>(XR_TYPE_SPACE_LOCATION);
    check_xr(xrLocateSpace(spaces_.at(hand), session_.room(), seen_at, &location), "xrLocateSpace");
    HandPose& pose = poses.at(hand);
    pose.is_tracked = is_tracked(location.locationFlags);
    if (pose.is_tracked) pose.T_world_grip = to_rigid(location.pose);
    pose.takes = takes(hand);
  }
  return poses;
}

}  // namespace tactus
