#pragma once
/// A scene that runs on a thread of its own while somebody looks.
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "tactus/run/frame_loop.h"
#include "tactus/run/scene_view.h"
#include "tactus/window/camera_sink.h"
#include "tactus/window/seen_frames.h"
#include "tactus/window/view_sink.h"

namespace tactus {

/// Owns the physics' thread, and on it source, perception and world. A restart makes them anew.
///
///   LiveRun run(scene, {.named = "scenes/demo.yaml", .devices = "auto"});
///   run.start([] { glfwPostEmptyEvent(); });
///   per picture: if (auto view = run.take_view()) ...; if (auto frame = run.take_frame()) ...
class LiveRun {
 public:
  enum class State : std::uint8_t { building, running, ended, failed };
  struct Options {
    std::string named = "scene";  ///< before messages: the scene's file
    std::string devices = "auto";
    std::vector<std::string> tools;        ///< names of held obstacles and blades that the mouse may hold
    std::size_t past_bytes = 256'000'000;  ///< of frames that were seen; 0: none is kept
    double budget_s = 0;                   ///< that a frame should take; 0: the time between the source's
  };
  LiveRun(Scene scene, Options options);
  /// Stops and waits for the frame that runs.
  ~LiveRun();
  LiveRun(const LiveRun&) = delete;
  LiveRun& operator=(const LiveRun&) = delete;

  /// @param on_news called on the physics' thread whenever there is something to take
  void start(std::function<void()> on_news);
  /// Asks the physics to end. @returns whether it and the checkup have ended within so many seconds.
  bool stop(double wait_s);

  RunControl& control() { return control_; }
  const Scene& scene() const { return scene_; }
  const std::vector<std::string>& tools() const { return options_.tools; }
  State state() const;
  /// After each start and restart, before its first frame: the caller's own from then on.
  std::unique_ptr<SceneView> take_view() { return view_.take(); }
  /// The newest frame since the last call, or nullptr.
  std::shared_ptr<const ViewedFrame> take_frame() { return frame_.take(); }
  /// The newest images of cameras since the last call, or nullptr; none come while they aren't shown.
  std::shared_ptr<const CameraLook> take_cameras() { return cameras_.take(); }
  void show_cameras(bool shows) { shows_cameras_ = shows; }
  const RigCheckup& checkup() const { return checkup_; }
  /// Frames that were seen. Goes on while the physics runs.
  const SeenFrames& past() const { return past_; }
  /// The state that RunControl::keep() kept; nullptr: none.
  std::shared_ptr<const PastState> kept() const;
  /// Keeps a state of the past.
  void keep(std::shared_ptr<const PastState> state);
  /// Starts again from there: the frames after it, with the same bits where nobody touches or sets anything.
  void simulate_again(std::shared_ptr<const PastState> state);
  /// Why this run can't do that; "": it can.
  std::string why_not_again() const { return saver_.why_not(); }
  /// @throws the exception that ended the physics; nothing where none did.
  void rethrow_failure();

 private:
  void work() noexcept;
  void remember(const std::shared_ptr<const ViewedFrame>& frame, World& world, const RunProgress& progress);
  double budget_ms(const FrameSource& source) const;
  /// From start to stop or restart.
  RunControl::Turn run_once(DeviceSet& devices);
  void set_state(State state);

  const Scene scene_;
  const Options options_;
  RunControl control_;
  NewestOne<std::unique_ptr<SceneView>> view_;
  NewestOne<std::shared_ptr<const ViewedFrame>> frame_;
  NewestOne<std::shared_ptr<const CameraLook>> cameras_;
  std::atomic<bool> shows_cameras_{false};
  std::function<void()> on_news_;
  mutable std::mutex mutex_;
  std::condition_variable ended_;
  State state_ = State::building;
  bool has_ended_ = false;
  std::exception_ptr failure_;
  std::shared_ptr<const PastState> kept_, again_;  ///< again: from where the next run begins
  StateSaver saver_;
  SeenFrames past_;
  RigCheckup checkup_;
  std::thread thread_;
};

}  // namespace tactus
