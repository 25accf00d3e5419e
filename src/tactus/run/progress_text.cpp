#include "tactus/run/progress_text.h"

#include <cmath>
#include <cstdio>

namespace tactus {
namespace {

/// "45 s", "3 min 20 s", "2 h 5 min".
std::string duration_text(double seconds) {
  const auto s = static_cast<long long>(std::ceil(seconds));
  if (s < 60) return std::to_string(s) + " s";
  if (s < 3600) return std::to_string(s / 60) + " min " + std::to_string(s % 60) + " s";
  return std::to_string(s / 3600) + " h " + std::to_string(s / 60 % 60) + " min";
}

}  // namespace

std::string progress_text(int done, std::optional<int> total, double elapsed_s) {
  std::string text = "frame " + std::to_string(done);
  if (!total) return text;
  text += " of " + std::to_string(*total);
  if (done <= 0 || done >= *total) return text;
  return text + ", " + duration_text(elapsed_s / done * (*total - done)) + " left";
}

std::string times_text(const RunFrame& frame) {
  const Timings& t = frame.world.timings();
  char text[160] = "";
  if (frame.world.perception() != nullptr)
    std::snprintf(text, sizeof text, "hull %.1f ms   mesh %.1f ms   ", t.last_ms("hull"), t.last_ms("mesh"));
  const std::string hull = text;
  std::snprintf(text, sizeof text, "bodies %.1f ms (%d substeps)   frame %.1f ms", t.last_ms("bodies"),
                frame.report.substeps, t.last_ms("frame"));
  return hull + text;
}

std::string caption_text(const RunFrame& frame) {
  return "frame " + std::to_string(frame.images.tick) + "   " + times_text(frame);
}

}  // namespace tactus
