#pragma once
/// `source: {kind: none}`: scenes that nobody films. Time passes, and nothing real takes part.
#include "tactus/rig/sources/frame_source.h"

namespace tactus {

class NoCameras : public FrameSource {
 public:
  /// @param first,count frames: frame i is at i / fps
  NoCameras(std::int64_t first, std::int64_t count, double fps)
      : tick_(first), end_(first + count), fps_(fps) {}

  const Rig& rig() const override { return rig_; }
  std::optional<int> frame_count() const override { return static_cast<int>(end_ - tick_); }
  std::optional<double> fps() const override { return fps_; }
  NextFrame next(FrameSet& frame) override {
    if (tick_ >= end_) return NextFrame::no_more_data;
    frame = {};
    frame.tick = tick_++;
    frame.time_s = static_cast<double>(frame.tick) / fps_;
    return NextFrame::nothing_new;
  }
  std::string status() const override { return ""; }

 private:
  Rig rig_;  ///< without cameras
  std::int64_t tick_, end_;
  double fps_;
};

}  // namespace tactus
