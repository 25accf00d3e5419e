#pragma once
/// How many substeps a frame takes, changed seldom.
#include <algorithm>

namespace tactus {

/// Every change of the step stirs a body's fastest modes: one between 34 and 40 substeps in each frame adds
/// 19 % of energy to a swinging bar in a minute. And what is recorded for one number of substeps has to be
/// recorded anew for another. So the number grows when it must, and shrinks when much fewer would do for
/// long. Parts of a frame have steps of the same length.
///
///   SubstepChoice choice;
///   int count = choice.of_frame(body.substeps_for(dt_frame_s), most);
///   count = choice.of_part(body.substeps_for(dt_frame_s), most);  // before each later part
class SubstepChoice {
 public:
  static constexpr int kFramesOfFewer = 60;
  static constexpr double kFewer = 0.8;

  /// @param needed for stability, this frame
  /// @param most that a frame may have
  int of_frame(int needed, int most) {
    needed = std::clamp(needed, 1, most);
    frames_of_fewer_ = needed < kFewer * count_ ? frames_of_fewer_ + 1 : 0;
    most_of_fewer_ = frames_of_fewer_ == 0 ? 0 : std::max(most_of_fewer_, needed);
    if (needed > count_) count_ = needed;
    if (frames_of_fewer_ < kFramesOfFewer) return count_;
    count_ = most_of_fewer_;
    frames_of_fewer_ = 0;
    most_of_fewer_ = 0;
    return count_;
  }

  /// Later in the frame. A need that grows is kept; one that jumps is a blow, over before the next frame.
  int of_part(int needed, int most) {
    needed = std::clamp(needed, 1, most);
    if (needed <= count_) return std::min(count_, most);
    if (kFewer * needed <= count_) count_ = needed;
    return needed;
  }

 private:
  int count_ = 0, frames_of_fewer_ = 0, most_of_fewer_ = 0;
};

}  // namespace tactus
