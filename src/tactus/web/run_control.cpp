#include "tactus/web/run_control.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"

namespace tactus {
namespace {

/// Steps that a viewer may ask for before the first of them is done.
constexpr int kMostSteps = 100;
/// A frame that took longer than its time delays those after it, up to this much; what is later is lost.
constexpr double kMostLate_s = 0.1, kLongestFrame_s = 0.25;

}  // namespace

void RunControl::check(const ClientMessage& message) const {
  if (message.kind == ClientMessage::Kind::pose &&
      std::find(options_.held.begin(), options_.held.end(), message.name) == options_.held.end())
    throw Error("'obstacle': '" + printable(message.name.substr(0, 16)) + "' is not held" +
                (options_.held.empty() ? "; no obstacle of the scene has 'held: true'"
                                       : suggestion(message.name, options_.held)));
  if (message.kind != ClientMessage::Kind::set) return;
  std::vector<std::string> known;
  for (const SceneParameter& p : options_.parameters) {
    known.push_back(p.name);
    if (p.name != message.name) continue;
    if (!p.allows(message.value))
      throw Error("'" + p.name + "': " + number_text(message.value) + ", expected " + p.range_text());
    return;
  }
  throw Error("'parameter': '" + printable(message.name.substr(0, 48)) + "' may not change" +
              (known.empty() ? "; nothing of this run may" : suggestion(message.name, known)));
}

std::string RunControl::handle(std::string_view text) {
  ClientMessage message;
  try {
    if (!options_.is_allowed) throw Error("viewers may only look: start the run with --web-control");
    message = parse_client_message(text);
    check(message);
  } catch (const Error& error) {
    return error.what();
  }
  bool changed = false;
  {
    const std::lock_guard lock(mutex_);
    const State before = state_;
    switch (message.kind) {
      case ClientMessage::Kind::pause:
        if (state_ != State::ended) state_ = State::paused;
        break;
      case ClientMessage::Kind::run:
        if (state_ == State::paused) state_ = State::running;
        steps_ = 0;
        break;
      case ClientMessage::Kind::step:
        if (state_ != State::ended) state_ = State::paused;
        steps_ = std::min(steps_ + 1, kMostSteps);
        break;
      case ClientMessage::Kind::pose:
        poses_[message.name] = message.T_world_obstacle;
        break;
      case ClientMessage::Kind::set:
        values_[message.name] = message.value;
        break;
    }
    changed = before != state_;
  }
  if (changed && options_.state_changed) options_.state_changed();
  return "";
}

void RunControl::set_state(State state) {
  {
    const std::lock_guard lock(mutex_);
    if (state_ == state) return;
    state_ = state;
  }
  if (options_.state_changed) options_.state_changed();
}

bool RunControl::may_step() {
  bool starts = false;
  {
    const std::lock_guard lock(mutex_);
    const bool is_seen = !options_.has_viewers || options_.has_viewers();
    if (state_ == State::waiting) starts = !options_.waits_for_viewer || is_seen;
    if (state_ == State::paused && steps_ == 0) starts = !is_seen;
    if (state_ == State::paused && steps_ > 0) {
      --steps_;
      due_s_ = 0;
      return true;
    }
    if (state_ == State::running && (!options_.keeps_pace || now_s() >= due_s_)) return true;
  }
  if (starts) set_state(State::running);
  return false;
}

bool RunControl::wait_for_turn(const std::function<bool()>& should_stop) {
  while (true) {
    if (should_stop && should_stop()) return true;
    if (may_step()) return false;
    double left_s = 0.02;
    {
      const std::lock_guard lock(mutex_);
      if (state_ == State::running && options_.keeps_pace) left_s = std::clamp(due_s_ - now_s(), 0.0, 0.02);
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(left_s));
  }
}

std::string RunControl::apply(World& world, double time_s) {
  std::map<std::string, Rigidd> poses;
  std::map<std::string, double> values;
  {
    const std::lock_guard lock(mutex_);
    poses.swap(poses_);
    values.swap(values_);
    const double dt_s = has_time_ ? std::clamp(time_s - last_time_s_, 0.0, kLongestFrame_s) : 0;
    due_s_ = std::max(due_s_ + dt_s, now_s() - kMostLate_s);
    last_time_s_ = time_s;
    has_time_ = true;
  }
  std::string errors;
  const auto attempt = [&](const auto& change) {
    try {
      change();
    } catch (const Error& error) {
      errors += (errors.empty() ? "" : "; ") + std::string(error.what());
    }
  };
  for (const auto& pose : poses) attempt([&] { world.set_pose(pose.first, pose.second); });
  for (const auto& value : values) attempt([&] { world.parameters().set(value.first, value.second); });
  return errors;
}

std::string RunControl::state() const {
  const std::lock_guard lock(mutex_);
  switch (state_) {
    case State::waiting:
      return "waiting";
    case State::running:
      return "running";
    case State::paused:
      return "paused";
    case State::ended:
      break;
  }
  return "ended";
}

void RunControl::end() { set_state(State::ended); }

}  // namespace tactus
