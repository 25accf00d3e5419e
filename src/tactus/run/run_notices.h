#pragma once
/// Statuses and notices of a run, each once.
#include <string>
#include <vector>

#include "tactus/sim/notice.h"

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

}  // namespace tactus
