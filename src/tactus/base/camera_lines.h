#pragma once
/// Texts about several cameras at once, camera by camera.
#include <string>
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

/// The camera that a line begins with; "": none.
inline std::string_view camera_of_line(std::string_view line) {
  constexpr std::string_view kBegin = "camera '";
  if (!line.starts_with(kBegin)) return {};
  const auto end = line.find("': ", kBegin.size());
  return end == line.npos ? std::string_view{} : line.substr(kBegin.size(), end - kBegin.size());
}

/// A line without the name of its camera and without numbers, which differ from camera to camera.
inline std::string kind_of_line(std::string_view line) {
  const std::string_view name = camera_of_line(line);
  const auto is_in_word = [&](std::size_t i) {
    return i < line.size() && ((line[i] >= 'a' && line[i] <= 'z') || (line[i] >= 'A' && line[i] <= 'Z'));
  };
  std::string kind;
  for (std::size_t i = 0; i < line.size();) {
    const bool is_word = (i == 0 || !is_in_word(i - 1)) && !is_in_word(i + name.size());
    if (!name.empty() && is_word && line.substr(i).starts_with(name)) {
      i += name.size();
      kind += '@';
    } else if (line[i] >= '0' && line[i] <= '9') {
      while (i < line.size() && line[i] >= '0' && line[i] <= '9') ++i;
      kind += '#';
    } else {
      kind += line[i++];
    }
  }
  return kind;
}

/// Those lines, where cameras that differ in numbers alone follow the first of them by name:
/// "camera 'a': the hull covers 44 % of its mask; likewise 'b', 'c'".
inline std::vector<std::string> grouped_camera_lines(std::string_view text) {
  std::vector<std::string> lines, kinds;
  std::vector<bool> has_others;
  for (const std::string_view line : camera_lines(text)) {
    const std::string kind = camera_of_line(line).empty() ? "" : kind_of_line(line);
    std::size_t k = 0;
    while (k < lines.size() && (kind.empty() || kinds[k] != kind)) ++k;
    if (k == lines.size()) {
      lines.emplace_back(line);
      kinds.push_back(kind);
      has_others.push_back(false);
      continue;
    }
    lines[k].append(has_others[k] ? ", '" : "; likewise '").append(camera_of_line(line)).append("'");
    has_others[k] = true;
  }
  return lines;
}

}  // namespace tactus
