#pragma once
/// Ctrl-C, SIGTERM and a terminal that is lost (SIGHUP, unless it is ignored). The first signal asks: long
/// loops poll, finish the frame and their files, and the program exits with 130. The second ends the program
/// at once; its temporary files go, finished files stay. The same signal within 20 ms counts as the first.
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace tactus {
void install_interrupt_handler();
bool interrupted();

/// Gives a frame up that isn't finished 1.2 s after the first signal: at high resolutions one takes minutes.
class FramePatience {
 public:
  /// @param give_up writes the results of earlier frames; called on another thread, and never beside the work
  /// between end() and begin(). Then the program ends with 130, as after a frame that was finished.
  explicit FramePatience(std::function<void()> give_up);
  FramePatience(const FramePatience&) = delete;
  FramePatience& operator=(const FramePatience&) = delete;
  ~FramePatience();
  /// A frame, or other work that leaves nothing behind, begins or ends.
  void begin();
  void end();

 private:
  void watch();
  std::function<void()> give_up_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool works_ = false, is_over_ = false;
  std::thread thread_;
};
}  // namespace tactus
