#pragma once
/// Reductions of quality in frames that have too little time, and the budget that decides when they are made.
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tactus/perception/perception.h"

namespace tactus {

/// Decides from the times of frames how many reductions the next ones make. Knows no clock: frames
/// come with theirs.
///
/// Two frames in a row above the budget make one reduction more. A reduction is given up
/// again when the last 10 frames would all have stayed below 0.9 of the budget without it, by the time that
/// it saved when it was made. A reduction that is needed again within a second is then kept for a
/// second, and each time this happens for twice as long, up to 8 s. So reductions come and go at most
/// once a second.
class FrameBudget {
 public:
  /// @param budget_s of a frame, > 0 @param reductions that can be made
  FrameBudget(double budget_s, std::size_t quality_reductions)
      : budget_s_(budget_s), gains_(quality_reductions, 1.0) {}

  /// @param frame_s that a frame with new images took @param now_s when it ended
  /// @returns how many reductions the coming frames make.
  std::size_t next(double frame_s, double now_s);
  double budget_s() const { return budget_s_; }
  std::int64_t frames_above() const { return frames_above_; }

 private:
  static constexpr std::size_t kCalmFrames = 10;
  static constexpr double kCalm = 0.9, kLeastHold_s = 1, kMostHold_s = 8;
  void save(double now_s);

  double budget_s_;
  std::vector<double> gains_;  ///< per reduction: time of a frame without it over that with it
  std::size_t made_ = 0;
  std::int64_t frames_above_ = 0;
  double last_s_ = 0;       ///< time of the frame before
  double without_s_ = 0;    ///< of frames before the last reduction was made; 0: its gain is known
  std::size_t frames_ = 0;  ///< since the number of reductions changed
  std::array<double, kCalmFrames> recent_s_{};
  double given_up_s_ = -1e9, held_until_s_ = -1e9, hold_s_ = 0;
};

}  // namespace tactus
