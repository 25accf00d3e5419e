#pragma once
/// Tools that hands take, move and put down. Knows no OpenXR.
#include <array>
#include <map>
#include <optional>
#include <string>

#include "tactus/base/vec.h"

namespace tactus {

/// A controller or a hand.
struct HandPose {
  bool is_tracked = false;
  bool takes = false;     ///< its trigger is pulled
  Rigidd T_world_grip{};  ///< where it is when the picture is seen
};

/// A pulled trigger takes the tool that is within reach and holds it as it is; an only tool comes from
/// farther, into the hand.
class HeldTools {
 public:
  static constexpr std::size_t kHands = 2;
  static constexpr double kReach_m = 0.15;

  struct Moved {
    std::string tool;
    Rigidd T_world_tool;
  };
  /// @param tools where each is now @returns where the hand's tool should go; nothing: the hand holds none,
  /// or isn't tracked
  std::optional<Moved> follow(std::size_t hand, const HandPose& pose,
                              const std::map<std::string, Rigidd>& tools);
  /// Name of the tool in that hand; "": none.
  const std::string& held(std::size_t hand) const { return hands_.at(hand).tool; }

 private:
  struct Hand {
    bool took = false;
    std::string tool;
    Rigidd T_grip_tool;
  };
  void take(Hand& hand, const HandPose& pose, const std::map<std::string, Rigidd>& tools) const;
  std::array<Hand, kHands> hands_;
};

/// Says when something that was tracked no longer is, within 100 ms where it is looked at ten times a second.
class PoseWatch {
 public:
  static constexpr double kPatience_s = 0.05;
  enum class News : std::uint8_t { none, lost, back };
  /// @param at_s when this is known, on the clock of now_s()
  News look(bool is_tracked, double at_s);

 private:
  bool was_seen_ = false, is_lost_ = false;
  double seen_at_s_ = 0;
};

}  // namespace tactus
