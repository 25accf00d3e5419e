#include "tactus/run/run_control.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "tactus/base/error.h"
#include "tactus/base/timing.h"
#include "tactus/geom/maths/rotation.h"

namespace tactus {
namespace {

/// Steps that may be asked for before the first of them is done.
constexpr int kMostSteps = 100;
/// A frame that took longer than its time delays those after it, up to this much; more is lost.
constexpr double kMostLate_s = 0.1, kLongestFrame_s = 0.25;
constexpr double kPoll_s = 0.02;

}  // namespace

const char* RunControl::text(State state) {
  constexpr const char* kText[] = {"waiting", "running", "paused", "ended"};
  return kText[static_cast<std::size_t>(state)];
}

void RunControl::unlock_and_report(std::unique_lock<std::mutex>& lock, State before) {
  const bool changed = state_ != before;
  changed_.notify_all();
  lock.unlock();
  if (changed && options_.state_changed) options_.state_changed();
}

void RunControl::set_state(State state) {
  std::unique_lock lock(mutex_);
  const State before = std::exchange(state_, state);
  unlock_and_report(lock, before);
}

void RunControl::set_paused(bool paused) {
  std::unique_lock lock(mutex_);
  const State before = state_;
  if (state_ != State::ended && (paused || state_ == State::paused))
    state_ = paused ? State::paused : State::running;
  steps_ = 0;
  unlock_and_report(lock, before);
}

void RunControl::toggle_pause() { set_paused(!is_paused()); }

void RunControl::step() {
  std::unique_lock lock(mutex_);
  const State before = state_;
  if (state_ != State::ended) state_ = State::paused;
  steps_ = std::min(steps_ + 1, kMostSteps);
  unlock_and_report(lock, before);
}

void RunControl::restart() {
  const std::lock_guard lock(mutex_);
  restarts_ = true;
  changed_.notify_all();
}

void RunControl::keep() {
  const std::lock_guard lock(mutex_);
  keeps_ = true;
  changed_.notify_all();
}

void RunControl::go_back() {
  const std::lock_guard lock(mutex_);
  restarts_ = goes_back_ = true;
  changed_.notify_all();
}

void RunControl::stop() {
  const std::lock_guard lock(mutex_);
  stops_ = true;
  changed_.notify_all();
}

RunControl::State RunControl::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void RunControl::move_tool(const std::string& name, const Rigidd& T_world_tool, double most_m_s) {
  const std::lock_guard lock(mutex_);
  AskedPose& asked = poses_[name];
  asked.T_world = T_world_tool;
  asked.most_m_s = most_m_s;
}

void RunControl::put_tool(const std::string& name, const Rigidd& T_world_tool) {
  const std::lock_guard lock(mutex_);
  poses_[name] = {T_world_tool, T_world_tool};
}

std::optional<Rigidd> RunControl::asked_pose(const std::string& tool) const {
  const std::lock_guard lock(mutex_);
  const auto found = poses_.find(tool);
  return found != poses_.end() ? std::optional(found->second.T_world) : std::nullopt;
}

void RunControl::set_grab(const std::optional<Grab>& grab) {
  const std::lock_guard lock(mutex_);
  grab_ = grab;
}

void RunControl::set_parameter(const std::string& name, double value) {
  const std::lock_guard lock(mutex_);
  parameters_[name] = value;
}

std::map<std::string, double> RunControl::pending_parameters() const {
  const std::lock_guard lock(mutex_);
  return parameters_;
}

bool RunControl::begin() {
  const std::lock_guard lock(mutex_);
  restarts_ = keeps_ = has_time_ = false;
  is_first_ = true;
  steps_ = 0;
  due_s_ = 0;
  if (state_ == State::ended) state_ = State::paused;
  poses_.clear();
  parameters_.clear();
  grab_.reset();
  return std::exchange(goes_back_, false);
}

bool RunControl::goes_back() const {
  const std::lock_guard lock(mutex_);
  return goes_back_;
}

double RunControl::left_s(bool is_unseen) const {
  constexpr double kLong_s = 3600;
  if (state_ == State::waiting) return kLong_s;
  if (is_first_ && options_.shows_first_frame) return 0;
  if (state_ == State::paused) return steps_ > 0 || is_unseen ? 0 : kLong_s;
  return options_.keeps_pace ? std::max(due_s_ - now_s(), 0.0) : 0;
}

RunControl::Turn RunControl::wait_for_turn(bool is_unseen, const std::function<bool()>& should_stop) {
  std::unique_lock lock(mutex_);
  for (;;) {
    lock.unlock();
    const bool stops = should_stop && should_stop(),
               is_seen = !options_.has_viewers || options_.has_viewers();
    lock.lock();
    if (stops || stops_) return Turn::stop;
    if (restarts_) return Turn::restart;
    if (std::exchange(keeps_, false)) return Turn::keep;
    const bool starts = state_ == State::waiting && (is_seen || !options_.waits_for_viewer),
               is_left = state_ == State::paused && steps_ == 0 && !is_seen;
    if (starts || is_left) {
      const State before = std::exchange(state_, State::running);
      unlock_and_report(lock, before);
      lock.lock();
      continue;
    }
    const double wait_s = left_s(is_unseen);
    if (!(wait_s > 0)) break;
    const bool polls = should_stop || options_.has_viewers;
    changed_.wait_for(lock, std::chrono::duration<double>(polls ? std::min(wait_s, kPoll_s) : wait_s));
  }
  const bool is_shown_first = std::exchange(is_first_, false) && options_.shows_first_frame;
  if (!is_shown_first && state_ == State::paused && steps_ > 0) {
    --steps_;
    due_s_ = 0;
  }
  return Turn::go;
}

RunControl::Turn RunControl::wait_for_restart() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return stops_ || restarts_ || keeps_; });
  if (stops_ || restarts_) return stops_ ? Turn::stop : Turn::restart;
  keeps_ = false;
  return Turn::keep;
}

void RunControl::note_frame(double time_s, double dt_s) {
  const std::lock_guard lock(mutex_);
  if (dt_s > 0) frame_s_ = dt_s;
  due_s_ = has_time_ ? std::max(due_s_ + std::clamp(time_s - last_time_s_, 0.0, kLongestFrame_s),
                                now_s() - kMostLate_s)
                     : now_s();
  last_time_s_ = time_s;
  has_time_ = true;
}

/// @returns whether it is there.
bool RunControl::move(World& world, const std::string& name, AskedPose& asked) const {
  if (asked.put) {
    world.set_pose(name, *std::exchange(asked.put, std::nullopt), true);
    return false;
  }
  Rigidd T = asked.T_world;
  const Rigidd from = world.pose(name);
  const Vec3d step_m = asked.T_world.t - from.t;
  const double most_m = std::min(options_.tool_speed_m_s, asked.most_m_s) * frame_s_,
               wanted_m = length(step_m);
  if (wanted_m > most_m) {
    const double share = most_m / wanted_m;
    T.t = from.t + share * step_m;
    // Turned as far as it went: the edge of a blade may be far from its origin, and would swing ahead.
    T.R = from.R * rotation_from_vector(share * vector_of_rotation(transpose(from.R) * T.R));
  }
  world.set_pose(name, T);
  return !(wanted_m > most_m);
}

RunControl::Applied RunControl::apply(World& world) {
  Applied applied;
  const auto attempt = [&](const auto& change) {
    try {
      return change();
    } catch (const Error& error) {
      applied.errors += (applied.errors.empty() ? "" : "; ") + std::string(error.what());
      return true;
    }
  };
  std::optional<std::optional<Grab>> grab;
  std::map<std::string, double> values;
  {
    const std::lock_guard lock(mutex_);
    applied.has_asked = !poses_.empty() || grab_ || !parameters_.empty();
    for (auto pose = poses_.begin(); pose != poses_.end();) {
      const bool is_there = attempt([&] { return move(world, pose->first, pose->second); });
      pose = is_there ? poses_.erase(pose) : std::next(pose);
    }
    grab.swap(grab_);
    values.swap(parameters_);
  }
  if (grab)
    attempt([&] {
      world.set_grab(*grab);
      return true;
    });
  for (const auto& value : values)
    attempt([&] {
      world.parameters().set(value.first, value.second);
      return true;
    });
  applied.has_set = !values.empty();
  return applied;
}

}  // namespace tactus
