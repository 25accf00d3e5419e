#include "tactus/window/run_control.h"

#include <chrono>

#include "tactus/base/timing.h"

namespace tactus {

void RunControl::set_paused(bool paused) {
  const std::lock_guard lock(mutex_);
  is_paused_ = paused;
  steps_due_ = 0;
  changed_.notify_all();
}

void RunControl::toggle_pause() {
  const std::lock_guard lock(mutex_);
  is_paused_ = !is_paused_;
  steps_due_ = 0;
  changed_.notify_all();
}

void RunControl::step() {
  const std::lock_guard lock(mutex_);
  is_paused_ = true;
  ++steps_due_;
  changed_.notify_all();
}

void RunControl::restart() {
  const std::lock_guard lock(mutex_);
  restarts_ = true;
  changed_.notify_all();
}

void RunControl::stop() {
  const std::lock_guard lock(mutex_);
  stops_ = true;
  changed_.notify_all();
}

bool RunControl::is_paused() const {
  const std::lock_guard lock(mutex_);
  return is_paused_;
}

void RunControl::move_tool(Vec3d to_m) {
  const std::lock_guard lock(mutex_);
  tool_target_m_ = to_m;
}

std::optional<Vec3d> RunControl::tool_target_m() const {
  const std::lock_guard lock(mutex_);
  return tool_target_m_;
}

void RunControl::begin() {
  const std::lock_guard lock(mutex_);
  restarts_ = false;
  is_first_ = true;
  steps_due_ = 0;
  tool_target_m_.reset();
}

RunControl::Turn RunControl::wait_for_turn(double earliest_s) {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (stops_) return Turn::stop;
    if (restarts_) return Turn::restart;
    if (is_first_ || steps_due_ > 0) break;
    const double wait_s = earliest_s - now_s();
    if (is_paused_)
      changed_.wait(lock);
    else if (wait_s > 0)
      changed_.wait_for(lock, std::chrono::duration<double>(wait_s));
    else
      break;
  }
  if (!is_first_ && steps_due_ > 0) --steps_due_;
  is_first_ = false;
  return Turn::go;
}

RunControl::Turn RunControl::wait_for_restart() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return stops_ || restarts_; });
  return stops_ ? Turn::stop : Turn::restart;
}

}  // namespace tactus
