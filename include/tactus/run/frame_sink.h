#pragma once
/// The sinks of a run: pictures, meshes, reports, budgets.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tactus/rig/sources/frame_source.h"
#include "tactus/sim/notice.h"
#include "tactus/world/world.h"

namespace tactus {

/// Logs and keeps statuses and notices that were not there before.
class RunNotices {
 public:
  /// A line of its own for each camera that it names. "" says nothing.
  void note(const std::string& status, Severity severity = Severity::warning);
  void note(const Notice& notice);

  const std::vector<std::string>& statuses() const { return statuses_; }
  /// At most 1000.
  const std::vector<Notice>& notices() const { return notices_; }

 private:
  std::vector<std::string> statuses_;
  std::vector<Notice> notices_;
};

/// A frame that was simulated, as sinks see it. Valid during FrameSink::frame.
class RunFrame {
 public:
  RunFrame(World& stepped, const FrameSet& seen, const StepReport& reported, RunNotices& noted)
      : world(stepped), images(seen), report(reported), notices(noted) {}

  /// The frame's surfaces and bodies for pictures, copied to the host once for all sinks. A call counts as
  /// showing the frame, for the latency of live images.
  std::shared_ptr<const FrameSnapshot> snapshot() {
    if (snapshot_ == nullptr) snapshot_ = std::make_shared<const FrameSnapshot>(world.snapshot());
    return snapshot_;
  }

  World& world;
  const FrameSet& images;  ///< where nothing new came, only its time means something
  const StepReport& report;
  RunNotices& notices;
  bool is_new = false;    ///< images came
  int number = 0;         ///< of frames that were simulated, from 1
  double taken_at_s = 0;  ///< when the images were there, on the clock of now_s()

 private:
  std::shared_ptr<const FrameSnapshot> snapshot_;
};

/// Sees each frame of a FrameLoop, in the order in which sinks were added, on the loop's thread. A sink does
/// long work on a thread of its own.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// Before the first frame. @param frame_count where it is known
  virtual void begin(const World& world, std::optional<int> frame_count) {
    static_cast<void>(world);
    static_cast<void>(frame_count);
  }
  virtual void frame(RunFrame& frame) = 0;
  /// After the last frame, not after an exception.
  virtual void end(RunNotices& notices) { static_cast<void>(notices); }
};

}  // namespace tactus
