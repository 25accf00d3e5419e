#pragma once
/// What viewers may do with a run: pause, step, hold tools.
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "tactus/web/client_message.h"
#include "tactus/world/world.h"

namespace tactus {

/// Viewers' threads call handle(); the run's thread calls wait_for_turn() before each frame and apply() after
/// it. Knows no sockets.
class RunControl {
 public:
  struct Options {
    bool is_allowed = false;  ///< else every message is refused by name
    /// No frame begins before its time has come. Off for live cameras, which have a clock of their own.
    bool keeps_pace = true;
    std::vector<std::string> held;           ///< obstacles that viewers may move
    std::vector<SceneParameter> parameters;  ///< those that viewers may set
    std::function<bool()> has_viewers;       ///< whether somebody looks; none: nobody is asked
    bool waits_for_viewer = false;           ///< the first frame does
    std::function<void()> state_changed;     ///< may be empty
  };
  explicit RunControl(Options options) : options_(std::move(options)) {}

  /// @returns the error of a message that was refused, with the remedy; or "".
  std::string handle(std::string_view text);
  /// Waits until the next frame is due: a viewer is there, nobody paused, its time has come. A pause ends
  /// when the last viewer left.
  /// @param should_stop asked every 20 ms @returns whether the run should stop
  bool wait_for_turn(const std::function<bool()>& should_stop);
  /// Moves held obstacles and sets parameters for the next frame. @param time_s of the frame that was stepped
  /// @returns what the world refused, or ""
  std::string apply(World& world, double time_s);
  /// "waiting", "running", "paused" or "ended".
  std::string state() const;
  void end();

 private:
  enum class State : std::uint8_t { waiting, running, paused, ended };
  void check(const ClientMessage& message) const;
  bool may_step();
  void set_state(State state);

  Options options_;
  mutable std::mutex mutex_;
  State state_ = State::waiting;
  int steps_ = 0;  ///< frames to simulate while paused
  std::map<std::string, Rigidd> poses_;
  std::map<std::string, double> values_;  ///< of parameters
  double last_time_s_ = 0, due_s_ = 0;    ///< due: on the clock of now_s()
  bool has_time_ = false;
};

}  // namespace tactus
