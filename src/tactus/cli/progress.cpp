#include "tactus/cli/progress.h"

#include <cmath>

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

}  // namespace tactus
