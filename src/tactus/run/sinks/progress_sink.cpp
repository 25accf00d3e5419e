#include "tactus/run/sinks/progress_sink.h"

#include <cstdio>

#include "tactus/base/log.h"
#include "tactus/run/progress_text.h"

namespace tactus {

void ProgressSink::begin(const World& /*world*/, std::optional<int> frame_count) {
  frame_count_ = frame_count;
  begin_s_ = now_s();
}

void ProgressSink::frame(RunFrame& frame) {
  log_debug(caption_text(frame));
  if (!is_shown_) return;
  const std::string text =
      progress_text(frame.number, frame_count_, now_s() - begin_s_) + "   " + times_text(frame);
  std::fprintf(stderr, "\r%s\033[K", text.c_str());
}

void ProgressSink::end(RunNotices& /*notices*/) {
  if (is_shown_) std::fputc('\n', stderr);
}

}  // namespace tactus
