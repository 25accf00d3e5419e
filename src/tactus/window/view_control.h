#pragma once
/// Pause, single steps, restart and the held tool of a run that somebody looks at.
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "tactus/base/vec.h"

namespace tactus {

/// Carries requests from the thread of the window to the thread of the physics. Thread-safe.
class ViewControl {
 public:
  enum class Turn : std::uint8_t { go, keep, restart, stop };

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
  bool is_paused() const;
  /// The tool goes there, as fast as it may.
  void move_tool(Vec3d to_m);
  /// A parameter of the scene (World::parameters), from the next frame on.
  void set_parameter(const std::string& name, double value);
  /// Those that no frame has yet.
  std::map<std::string, double> pending_parameters() const;

  // For the physics' thread.
  /// Waits until the next frame may run: not before `earliest_s` (on the clock of now_s()), and not while it
  /// is paused. The first frame after a start runs anyway: without it there is nothing to see.
  /// @param is_unseen nobody has seen the last frame: a pause lets one more run, which is shown
  Turn wait_for_turn(double earliest_s, bool is_unseen = false);
  /// Waits for keep(), restart() or stop(): the source has ended.
  Turn wait_for_restart();
  std::optional<Vec3d> tool_target_m() const;
  std::map<std::string, double> take_parameters();
  /// A run begins anew. @returns whether it goes back.
  bool begin();

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool is_paused_ = false, restarts_ = false, goes_back_ = false, keeps_ = false, stops_ = false,
       is_first_ = true;
  int steps_due_ = 0;
  std::optional<Vec3d> tool_target_m_;
  std::map<std::string, double> parameters_;
};

}  // namespace tactus
