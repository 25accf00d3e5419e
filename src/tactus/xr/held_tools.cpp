#include "tactus/xr/held_tools.h"

#include <algorithm>
#include <utility>

namespace tactus {

void HeldTools::take(Hand& hand, const HandPose& pose, const std::map<std::string, Rigidd>& tools) const {
  const auto is_free = [&](const std::string& name) {
    return std::none_of(hands_.begin(), hands_.end(), [&](const Hand& h) { return h.tool == name; });
  };
  const auto* nearest = static_cast<const std::pair<const std::string, Rigidd>*>(nullptr);
  const auto distance_m = [&](const Rigidd& T_world_tool) {
    return length(T_world_tool.t - pose.T_world_grip.t);
  };
  for (const auto& tool : tools)
    if (is_free(tool.first) && (nearest == nullptr || distance_m(tool.second) < distance_m(nearest->second)))
      nearest = &tool;
  if (nearest == nullptr) return;
  const bool is_near = distance_m(nearest->second) < kReach_m;
  if (!is_near && tools.size() > 1) return;
  hand.tool = nearest->first;
  hand.T_grip_tool = is_near ? inverse(pose.T_world_grip) * nearest->second : Rigidd{};
}

std::optional<HeldTools::Moved> HeldTools::follow(std::size_t number, const HandPose& pose,
                                                  const std::map<std::string, Rigidd>& tools) {
  Hand& hand = hands_.at(number);
  if (!pose.is_tracked) return std::nullopt;  // it holds on
  if (pose.takes && !hand.took) take(hand, pose, tools);
  if (!pose.takes) hand.tool.clear();
  hand.took = pose.takes;
  if (hand.tool.empty()) return std::nullopt;
  return Moved{hand.tool, pose.T_world_grip * hand.T_grip_tool};
}

PoseWatch::News PoseWatch::look(bool is_tracked, double at_s) {
  if (is_tracked) {
    seen_at_s_ = at_s;
    was_seen_ = true;
    return std::exchange(is_lost_, false) ? News::back : News::none;
  }
  if (!was_seen_ || is_lost_ || at_s - seen_at_s_ < kPatience_s) return News::none;
  is_lost_ = true;
  return News::lost;
}

}  // namespace tactus
