#include "tactus/perception/frame_quality.h"

#include <algorithm>

namespace tactus {

const char* quality_reduction_text(QualityReduction quality_reduction) {
  switch (quality_reduction) {
    case QualityReduction::photographs:
      return "the real surface is drawn without photographs";
    case QualityReduction::hull:
      return "the hull's voxels are twice as large";
    case QualityReduction::liquid:
      return "the liquid's steps have half their iterations, at least three";
    case QualityReduction::samples:
      break;
  }
  return "samples of the real surface are twice as far apart";
}

/// Makes one more reduction. One that is needed again within kLeastHold_s should not have been given
/// up.
void FrameBudget::save(double now_s) {
  if (now_s - given_up_s_ < kLeastHold_s) {
    hold_s_ = std::clamp(2 * hold_s_, kLeastHold_s, kMostHold_s);
    held_until_s_ = now_s + hold_s_;
  } else {
    hold_s_ = 0;
  }
  without_s_ = 0;
  ++made_;
}

std::size_t FrameBudget::next(double frame_s, double now_s) {
  const bool is_above = frame_s > budget_s_, was_above = frames_ > 0 && last_s_ > budget_s_;
  recent_s_[frames_ % kCalmFrames] = frame_s;
  if (is_above) ++frames_above_;
  ++frames_;
  if (frames_ == 2 && without_s_ > 0)
    gains_[made_ - 1] = std::max(1.0, without_s_ / std::min(frame_s, last_s_));
  const double before_s = std::min(frame_s, last_s_);
  last_s_ = frame_s;
  if (is_above && was_above && made_ < gains_.size()) {
    save(now_s);
    without_s_ = before_s;
    frames_ = 0;
    return made_;
  }
  if (made_ == 0 || frames_ < kCalmFrames || now_s < held_until_s_) return made_;
  const double worst_s = *std::max_element(recent_s_.begin(), recent_s_.end());
  if (worst_s * gains_[made_ - 1] < kCalm * budget_s_) {
    --made_;
    without_s_ = 0;
    given_up_s_ = now_s;
    frames_ = 0;
  }
  return made_;
}

}  // namespace tactus
