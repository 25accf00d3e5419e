#pragma once
/// One line at a terminal: the frame's number, time left, and the time that the frame took.
#include "tactus/run/frame_sink.h"

namespace tactus {

class ProgressSink final : public FrameSink {
 public:
  /// @param is_shown else frames go to the debug log alone
  explicit ProgressSink(bool is_shown) : is_shown_(is_shown) {}
  void begin(const World& world, std::optional<int> frame_count) override;
  void frame(RunFrame& frame) override;
  void end(RunNotices& notices) override;

 private:
  bool is_shown_;
  std::optional<int> frame_count_;
  double begin_s_ = 0;
};

}  // namespace tactus
