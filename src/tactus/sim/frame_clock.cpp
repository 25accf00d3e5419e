#include "tactus/sim/frame_clock.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"

namespace tactus {
namespace {

/// Captures farther apart say nothing of how the surface moved between them.
constexpr double kBreak_s = 2;
/// Time stamps that are nearer are one instant, to rounding: no solver steps so little.
constexpr double kInstant_s = 1e-6;

std::string seconds(double value) { return number_text(value) + " s"; }

}  // namespace

FrameTimes FrameClock::next(double dt_s, bool has_new_surface) {
  FrameTimes times;
  const double asked_s = fixed_dt_s_.value_or(dt_s);
  const bool broken = !std::isfinite(asked_s) || asked_s < 0 || asked_s > kBreak_s;
  if (broken) {
    times.notices.push_back({"clock.jump", Severity::warning,
                             "the capture clock jumped by " + seconds(asked_s) +
                                 "; nothing is simulated of it and the real surface stands still for a frame",
                             "check the source's time stamps"});
  }
  const double whole_s = broken || asked_s < kInstant_s ? 0 : asked_s;
  times.dt_s = fixed_dt_s_ ? whole_s : std::min(whole_s, longest_s_);
  if (times.dt_s < whole_s) {
    times.notices.push_back({"clock.clamped", Severity::warning,
                             "a frame of " + seconds(whole_s) + " simulates only " + seconds(times.dt_s),
                             "give more frames per second, or raise frame.max_dt_s"});
  }
  if (has_new_surface) {
    times.dt_capture_s = has_surface_ && !broken ? since_capture_s_ + whole_s : 0;
    times.surface_age_s = -times.dt_s;
    since_capture_s_ = simulated_since_capture_s_ = 0;
    has_surface_ = true;
  } else {
    times.surface_age_s = simulated_since_capture_s_;
    simulated_since_capture_s_ += times.dt_s;
    since_capture_s_ += whole_s;
  }
  simulated_s_ += times.dt_s;
  return times;
}

}  // namespace tactus
