#pragma once
/// Requests of people who look at a run: pauses, steps, restarts, tools, grabs and parameters.
#include <condition_variable>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "tactus/world/world.h"

namespace tactus {

/// Carries requests from the threads of those who look to the thread of the physics. Thread-safe. That thread
/// calls:
///
///   per run: begin();
///   per frame: wait_for_turn(); apply(world); ...; note_frame(time_s, dt_s);
class RunControl {
 public:
  enum class State : std::uint8_t { waiting, running, paused, ended };
  enum class Turn : std::uint8_t { go, keep, restart, stop };
  struct Options {
    /// No frame begins before its time has come. Off for live cameras, which have a clock of their own.
    bool keeps_pace = true;
    /// The first frame runs even when it is paused: without it there is nothing to see.
    bool shows_first_frame = false;
    bool waits_for_viewer = false;      ///< the first frame does
    std::function<bool()> has_viewers;  ///< whether somebody looks; none: always
    std::function<void()> state_changed;
    /// Tools go no faster where they are asked to go; a hand's 0.5 keeps them from jumping through things.
    double tool_speed_m_s = std::numeric_limits<double>::infinity();
    double frame_s = 1.0 / 30;  ///< simulated per frame, until a frame was noted
  };
  RunControl() : RunControl(Options()) {}
  explicit RunControl(Options options) : options_(std::move(options)), frame_s_(options_.frame_s) {}

  void set_paused(bool paused);
  void toggle_pause();
  /// Pauses, and lets one frame run.
  void step();
  void restart();
  /// Keeps the state between two frames, for go_back().
  void keep();
  /// Starts again from there.
  void go_back();
  /// The physics ends after its frame. Nothing takes it back.
  void stop();
  State state() const;
  bool is_paused() const { return state() == State::paused; }
  /// "waiting", "running", "paused" or "ended".
  static const char* text(State state);
  /// An obstacle or a blade with `held: true` goes there. @param most_m_s no faster than this, nor than all
  /// tools
  void move_tool(const std::string& name, const Rigidd& T_world_tool,
                 double most_m_s = std::numeric_limits<double>::infinity());
  /// It is put down there, not led there; move_tool() then goes on from there.
  void put_tool(const std::string& name, const Rigidd& T_world_tool);
  /// Where it was asked to go and isn't yet.
  std::optional<Rigidd> asked_pose(const std::string& tool) const;
  /// As World::set_grab.
  void set_grab(const std::optional<Grab>& grab);
  /// A parameter of the scene (World::parameters), from the next frame on.
  void set_parameter(const std::string& name, double value);
  /// Those that no frame has yet.
  std::map<std::string, double> pending_parameters() const;

  // For the physics' thread.
  /// A run begins anew; one that had ended is paused. @returns whether it goes back.
  bool begin();
  /// It is to, and hasn't begun.
  bool goes_back() const;
  /// Waits until the next frame may run: somebody looks, nobody paused, its time has come. A pause ends when
  /// the last viewer left.
  /// @param is_unseen nobody has seen the last frame: a pause lets one more run, which is shown
  /// @param should_stop asked every 20 ms; then the turn is to stop
  Turn wait_for_turn(bool is_unseen = false, const std::function<bool()>& should_stop = {});
  /// Waits for keep(), restart() or stop(): the source has ended.
  Turn wait_for_restart();
  /// Moves tools, grabs and sets parameters for the next frame.
  struct Applied {
    bool has_asked = false;  ///< for any of it
    bool has_set = false;    ///< parameters
    std::string errors;      ///< of requests that the world refused, or ""
  };
  Applied apply(World& world);
  /// A frame was stepped. @param time_s its source's @param dt_s simulated
  void note_frame(double time_s, double dt_s);
  void end() { set_state(State::ended); }

 private:
  void set_state(State state);
  /// Says so where the state isn't `before` any more.
  void unlock_and_report(std::unique_lock<std::mutex>& lock, State before);
  /// Seconds to wait; 0: the frame may run.
  double left_s(bool is_unseen) const;
  struct AskedPose {
    Rigidd T_world;
    std::optional<Rigidd> put = {};  ///< first
    double most_m_s = std::numeric_limits<double>::infinity();
  };
  bool move(World& world, const std::string& name, AskedPose& asked) const;

  Options options_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  State state_ = State::waiting;
  bool restarts_ = false, goes_back_ = false, keeps_ = false, stops_ = false, is_first_ = true;
  int steps_ = 0;  ///< frames to simulate while paused
  std::map<std::string, AskedPose> poses_;
  std::map<std::string, double> parameters_;
  std::optional<std::optional<Grab>> grab_;  ///< none: as before
  double frame_s_;                           ///< simulated
  double last_time_s_ = 0, due_s_ = 0;       ///< due: on the clock of now_s()
  bool has_time_ = false;
};

}  // namespace tactus
