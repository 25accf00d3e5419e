#include "tactus/run/run_notices.h"

#include <algorithm>

#include "tactus/base/log.h"

namespace tactus {

void RunNotices::note(const std::string& status, Severity severity) {
  // "camera 'a': ...; camera 'b': ...": a line a camera, which is then told once, whatever others do.
  if (const auto next = status.find("; camera '"); next != std::string::npos) {
    note(status.substr(0, next), severity);
    return note(status.substr(next + 2), severity);
  }
  if (status.empty() || std::find(statuses_.begin(), statuses_.end(), status) != statuses_.end()) return;
  statuses_.push_back(status);
  severity == Severity::info ? log_info(status) : log_warning(status);
}

void RunNotices::note(const Notice& notice) {
  constexpr std::size_t kMost = 1000;
  const auto same = [&](const Notice& n) { return n.code == notice.code && n.text == notice.text; };
  if (notices_.size() < kMost && std::none_of(notices_.begin(), notices_.end(), same))
    notices_.push_back(notice);
  note(notice.message(), notice.severity);
}

}  // namespace tactus
