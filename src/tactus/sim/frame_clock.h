#pragma once
/// Simulated time and the age of the real surface, frame after frame.
#include <optional>

#include "tactus/frame/frame_params.h"
#include "tactus/frame/state_archive.h"
#include "tactus/sim/notice.h"

namespace tactus {

/// Times of one frame.
struct FrameTimes {
  double dt_s = 0;           ///< simulated
  double dt_capture_s = 0;   ///< between the last two captures; 0: the surface stands still
  double surface_age_s = 0;  ///< of the surface when the frame begins: negative, it is captured at its end
  std::vector<Notice> notices = {};
};

/// A frame with a new surface begins where the last one was captured and ends at the new capture. A frame
/// without goes on from there; the surface keeps its motion. Intervals longer than the longest that a frame
/// can hold are cut; clocks that go back or jump are a break, after which the surface stands still once.
class FrameClock {
 public:
  /// @param longest_s a frame simulates no more @param fixed_dt_s simulated time of every frame, when given
  FrameClock(double longest_s, std::optional<double> fixed_dt_s)
      : longest_s_(longest_s), fixed_dt_s_(fixed_dt_s) {}

  /// @param dt_s since the last frame: to this one's capture, or, without a new surface, to now
  FrameTimes next(double dt_s, bool has_new_surface);
  double simulated_s() const { return simulated_s_; }
  void archive(StateArchive& a) {
    a.value("simulated time", simulated_s_);
    a.value("simulated time since the capture", simulated_since_capture_s_);
    a.value("time since the capture", since_capture_s_);
    a.value("whether there was a surface", has_surface_);
  }

 private:
  double longest_s_;
  std::optional<double> fixed_dt_s_;
  double simulated_since_capture_s_ = 0, since_capture_s_ = 0;
  double simulated_s_ = 0;
  bool has_surface_ = false;
};

}  // namespace tactus
