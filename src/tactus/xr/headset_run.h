#pragma once
/// The physics of a scene in a headset, on a thread of its own.
#include <condition_variable>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tactus/run/frame_sink.h"
#include "tactus/run/scene_view.h"

namespace tactus {

/// A frame for the headset: plain data of its own.
struct HeadsetFrame {
  std::shared_ptr<const FrameSnapshot> snapshot;
  std::vector<ColorImage> photos;       ///< of the rig's cameras, where the scene wears them
  std::map<std::string, Rigidd> tools;  ///< where each held obstacle is
};

/// Owns the thread, and on it source, perception and world. Frames that nobody took are not copied.
class HeadsetRun {
 public:
  HeadsetRun(Scene scene, std::string named, std::string devices);
  /// Stops and waits for the frame that runs.
  ~HeadsetRun();
  HeadsetRun(const HeadsetRun&) = delete;
  HeadsetRun& operator=(const HeadsetRun&) = delete;

  void start();
  /// Before the first frame, once: the caller's own from then on.
  std::unique_ptr<SceneView> take_view();
  /// The newest frame since the last call, or nullptr.
  std::unique_ptr<HeadsetFrame> take_frame();
  /// Where a held obstacle should be from the next frame on. It goes there as fast as a hand.
  void move_tool(const std::string& name, const Rigidd& T_world_tool);
  /// @throws the exception that ended the physics; nothing where none did.
  void rethrow_failure() const;

 private:
  class Sink;
  void work() noexcept;
  void run_scene();

  const Scene scene_;
  const std::string named_, devices_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool stops_ = false;
  std::map<std::string, Rigidd> wanted_;  ///< poses of tools
  std::unique_ptr<SceneView> view_;
  std::unique_ptr<HeadsetFrame> frame_;
  std::exception_ptr failure_;
  std::thread thread_;
};

}  // namespace tactus
