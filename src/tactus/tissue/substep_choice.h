#pragma once
/// How many substeps a frame takes, so that their length changes seldom.
#include <algorithm>
#include <cmath>

namespace tactus {

/// Every change of the step stirs a body's fastest modes: one between 34 and 40 substeps in each frame adds
/// 19 % of energy to a swinging bar in a minute. And a frame recorded for one number of substeps has to be
/// recorded anew for another. So the step gets shorter when it must, and longer when a much longer one would
/// do for many frames. Parts of a frame have steps of the same length; a frame that lasts longer has more of
/// them, and leaves the step as it is.
///
///   SubstepChoice choice;
///   int count = choice.of_frame(frame_s, body.substeps_for(frame_s), most);
///   count = choice.of_part(frame_s, body.substeps_for(frame_s), most);  // before each later part
class SubstepChoice {
 public:
  static constexpr int kFramesOfFewer = 60;
  static constexpr double kFewer = 0.8;

  /// @param needed for stability, in a frame of `frame_s`
  /// @param most that a frame may have
  int of_frame(double frame_s, int needed, int most) {
    needed = std::clamp(needed, 1, most);
    const double needed_s = frame_s / needed;
    const int kept = kept_in(frame_s);
    frames_of_fewer_ = needed < kFewer * kept ? frames_of_fewer_ + 1 : 0;
    shortest_of_fewer_s_ = frames_of_fewer_ > 1 ? std::min(shortest_of_fewer_s_, needed_s) : needed_s;
    if (needed > kept) step_s_ = needed_s;
    if (frames_of_fewer_ >= kFramesOfFewer) {
      step_s_ = shortest_of_fewer_s_;
      frames_of_fewer_ = 0;
    }
    return std::min(kept_in(frame_s), most);
  }

  /// Later in the frame, or while something fast passes. A need that grows is kept; one that jumps is a blow,
  /// over before the next frame.
  int of_part(double frame_s, int needed, int most) {
    needed = std::clamp(needed, 1, most);
    const int kept = kept_in(frame_s);
    if (needed <= kept) return std::min(kept, most);
    if (kFewer * needed <= kept) step_s_ = frame_s / needed;
    return needed;
  }

 private:
  /// Rounding of `frame_s / needed` asks for no substep more.
  int kept_in(double frame_s) const {
    return step_s_ > 0 ? static_cast<int>(std::ceil(frame_s / step_s_ - 1e-6)) : 0;
  }

  double step_s_ = 0, shortest_of_fewer_s_ = 0;
  int frames_of_fewer_ = 0;
};

}  // namespace tactus
