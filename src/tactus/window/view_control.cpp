#include "tactus/window/view_control.h"

#include <chrono>
#include <utility>

#include "tactus/base/timing.h"

namespace tactus {

void ViewControl::set_paused(bool paused) {
  const std::lock_guard lock(mutex_);
  is_paused_ = paused;
  steps_due_ = 0;
  changed_.notify_all();
}

void ViewControl::toggle_pause() {
  const std::lock_guard lock(mutex_);
  is_paused_ = !is_paused_;
  steps_due_ = 0;
  changed_.notify_all();
}

void ViewControl::step() {
  const std::lock_guard lock(mutex_);
  is_paused_ = true;
  ++steps_due_;
  changed_.notify_all();
}

void ViewControl::restart() {
  const std::lock_guard lock(mutex_);
  restarts_ = true;
  changed_.notify_all();
}

void ViewControl::keep() {
  const std::lock_guard lock(mutex_);
  keeps_ = true;
  changed_.notify_all();
}

void ViewControl::go_back() {
  const std::lock_guard lock(mutex_);
  restarts_ = goes_back_ = true;
  changed_.notify_all();
}

void ViewControl::stop() {
  const std::lock_guard lock(mutex_);
  stops_ = true;
  changed_.notify_all();
}

bool ViewControl::is_paused() const {
  const std::lock_guard lock(mutex_);
  return is_paused_;
}

void ViewControl::move_tool(Vec3d to_m) {
  const std::lock_guard lock(mutex_);
  tool_target_m_ = to_m;
}

std::optional<Vec3d> ViewControl::tool_target_m() const {
  const std::lock_guard lock(mutex_);
  return tool_target_m_;
}

void ViewControl::set_parameter(const std::string& name, double value) {
  const std::lock_guard lock(mutex_);
  parameters_[name] = value;
}

std::map<std::string, double> ViewControl::pending_parameters() const {
  const std::lock_guard lock(mutex_);
  return parameters_;
}

std::map<std::string, double> ViewControl::take_parameters() {
  const std::lock_guard lock(mutex_);
  return std::exchange(parameters_, {});
}

bool ViewControl::begin() {
  const std::lock_guard lock(mutex_);
  restarts_ = keeps_ = false;
  is_first_ = true;
  steps_due_ = 0;
  tool_target_m_.reset();
  parameters_.clear();
  return std::exchange(goes_back_, false);
}

ViewControl::Turn ViewControl::wait_for_turn(double earliest_s, bool is_unseen) {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (stops_) return Turn::stop;
    if (restarts_) return Turn::restart;
    if (std::exchange(keeps_, false)) return Turn::keep;
    if (is_first_ || steps_due_ > 0 || (is_paused_ && is_unseen)) break;
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

ViewControl::Turn ViewControl::wait_for_restart() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return stops_ || restarts_ || keeps_; });
  if (stops_ || restarts_) return stops_ ? Turn::stop : Turn::restart;
  keeps_ = false;
  return Turn::keep;
}

}  // namespace tactus
