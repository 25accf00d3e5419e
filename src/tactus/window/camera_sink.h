#pragma once
/// Hands images of cameras to a window.
#include <atomic>
#include <optional>

#include "tactus/run/frame_sink.h"
#include "tactus/run/run_control.h"
#include "tactus/window/camera_look.h"
#include "tactus/window/newest_one.h"
#include "tactus/window/rig_checkup.h"

namespace tactus {

/// On the physics' thread: copies silhouettes when the window shows them and has taken the last ones, and
/// gives the first sets to the checkup.
class CameraSink final : public FrameSink {
 public:
  struct Links {
    NewestOne<std::shared_ptr<const CameraLook>>& newest;
    const std::atomic<bool>& is_shown;
    RigCheckup& checkup;
  };
  /// Keeps references.
  CameraSink(const FrameSource& source, const RunControl& control, Links links, int frames_before);
  void frame(RunFrame& frame) override;
  /// The source may have fewer sets than the checkup waits for.
  void end(RunNotices& notices) override;

 private:
  const FrameSource& source_;
  const RunControl& control_;
  Links links_;
  int frames_before_;
  std::shared_ptr<const Rig> rig_;
  std::vector<std::optional<double>> seen_s_;  ///< each camera's newest image
};

}  // namespace tactus
