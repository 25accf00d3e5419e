#include "tactus/run/frame_sink.h"

#include <algorithm>

#include "tactus/base/camera_lines.h"
#include "tactus/base/log.h"

namespace tactus {

void RunNotices::note(const std::string& status, Severity severity) {
  // Each line of a camera is logged once, also when lines of other cameras change.
  std::string fresh;
  for (const std::string_view line : camera_lines(status)) {
    if (line.empty() || std::find(statuses_.begin(), statuses_.end(), line) != statuses_.end()) continue;
    statuses_.emplace_back(line);
    fresh.append(fresh.empty() ? "" : "; ").append(line);
  }
  if (fresh.empty()) return;
  severity == Severity::info ? log_info(fresh) : log_warning(fresh);
}

void RunNotices::note(const Notice& notice) {
  constexpr std::size_t kMost = 1000;
  const auto same = [&](const Notice& n) { return n.code == notice.code && n.text == notice.text; };
  if (notices_.size() < kMost && std::none_of(notices_.begin(), notices_.end(), same))
    notices_.push_back(notice);
  note(notice.message(), notice.severity);
}

}  // namespace tactus
