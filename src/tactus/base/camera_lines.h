#pragma once
/// What is said of several cameras at once, camera by camera.
#include <string_view>
#include <vector>

namespace tactus {

/// "camera 'a': ...; camera 'b': ..." as a line a camera; other texts as they are. Parts of `text`.
inline std::vector<std::string_view> camera_lines(std::string_view text) {
  std::vector<std::string_view> lines;
  for (auto next = text.find("; camera '"); next != text.npos; next = text.find("; camera '")) {
    lines.push_back(text.substr(0, next));
    text.remove_prefix(next + 2);
  }
  lines.push_back(text);
  return lines;
}

}  // namespace tactus
