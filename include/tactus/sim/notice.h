#pragma once
/// Notices to the user about a frame.
#include <string>
#include <vector>

namespace tactus {

enum class Severity { info, warning, error };
inline const char* severity_text(Severity severity) {
  return severity == Severity::info ? "info" : severity == Severity::warning ? "warning" : "error";
}

struct Notice {
  std::string code;  ///< stable, for programs: "hull.overflow"
  Severity severity = Severity::warning;
  std::string text;
  std::string remedy;  ///< how to mend it; may be empty
  /// "text: remedy".
  std::string message() const { return remedy.empty() ? text : text + ": " + remedy; }
};

/// All messages, one after the other.
inline std::string text_of(const std::vector<Notice>& notices) {
  std::string text;
  for (const Notice& notice : notices) text += (text.empty() ? "" : "; ") + notice.message();
  return text;
}

}  // namespace tactus
