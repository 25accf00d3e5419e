#include "tactus/rig/images/numbered_files.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <vector>

#include "tactus/base/error.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxNumber = 1000000000, kMaxGap = 10000;

std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code failed;
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    names.push_back(entry->path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// The number between a name's head and tail.
std::optional<int> number_in(std::string_view name, std::string_view head, std::string_view tail) {
  if (name.size() <= head.size() + tail.size() || !name.starts_with(head) || !name.ends_with(tail)) return {};
  name = name.substr(head.size(), name.size() - head.size() - tail.size());
  int number = -1;
  const auto [end, code] = std::from_chars(name.data(), name.data() + name.size(), number);
  if (code != std::errc() || end != name.data() + name.size() || number < 0) return {};
  return number;
}

}  // namespace

bool is_file(const std::string& path) {
  std::error_code failed;
  return fs::is_regular_file(path, failed);
}
bool is_there(const std::string& path) {
  std::error_code failed;
  return fs::exists(path, failed);
}

std::string suggest_file(const std::string& path) {
  const fs::path wanted(path);
  const std::vector<std::string> names = names_in(wanted.parent_path());
  const std::string near = nearest_spelling(wanted.filename().string(), names);
  return near.empty() ? "" : "; did you mean '" + near + "'?";
}

std::optional<NumberPlace> number_place(const std::string& path) {
  if (path.find('%') == std::string::npos) return {};
  if (is_there(path)) return {};
  std::error_code failed;
  std::optional<NumberPlace> place;
  bool is_first = true;
  for (std::size_t at = path.find('%'); at != std::string::npos; at = path.find('%', at + 1)) {
    const std::size_t end = path.find_first_not_of("0123456789", at + 1);
    if (end == std::string::npos || path[end] != 'd' || end - at > 3) continue;
    const fs::path folder = fs::path(path.substr(0, at) + "x").parent_path();
    if (is_first || fs::is_directory(folder, failed)) place = NumberPlace{at, end + 1};
    is_first = false;
  }
  return place;
}

NumberedFiles::NumberedFiles(std::string pattern) : pattern_(std::move(pattern)) {
  const std::optional<NumberPlace> place = number_place(pattern_);
  if (!place && pattern_.find('%') != std::string::npos && !is_there(pattern_))
    throw usage_error(pattern_ + ": expected one %d or %04d in the pattern");
  if (!place) return;
  const std::string digits = pattern_.substr(place->begin + 1, place->end - place->begin - 2);
  if (!digits.empty()) digits_ = std::stoul(digits);
  head_ = pattern_.substr(0, place->begin);
  tail_ = pattern_.substr(place->end);
  if (number_place(tail_)) throw usage_error(pattern_ + ": expected one %d or %04d in the pattern");
  is_sequence_ = true;
}

std::string NumberedFiles::file(int number) const {
  if (!is_sequence_) return pattern_;
  std::string digits = std::to_string(number);
  if (digits.size() < digits_) digits.insert(0, digits_ - digits.size(), '0');
  return head_ + digits + tail_;
}

std::vector<int> NumberedFiles::numbers() const {
  // The number may be part of a folder's name ("%04d/left.png"), so names are matched where it stands.
  const fs::path folder = fs::path(head_ + "x").parent_path();
  const std::string head = head_.substr(head_.rfind('/') + 1), tail = tail_.substr(0, tail_.find('/'));
  std::vector<int> found;
  std::string other;  // a number written in another width
  for (const std::string& name : names_in(folder)) {
    const std::optional<int> number = number_in(name, head, tail);
    if (!number) continue;
    if (!is_there(file(*number))) {
      other = name;
      continue;
    }
    if (*number > kMaxNumber)
      throw Error(pattern_ + ": '" + name + "' is no frame, expected numbers of at most " +
                  std::to_string(kMaxNumber));
    found.push_back(*number);
  }
  if (found.empty())
    throw Error(pattern_ + ": no file has such a name" +
                (other.empty() ? suggest_file(file(0))
                               : "; '" + other + "' is there (%d: plain numbers, %04d: four digits)"));
  std::sort(found.begin(), found.end());
  return found;
}

FrameWindow window_of(const std::string& path, std::vector<int> numbers, std::optional<int> first,
                      std::optional<int> last) {
  std::sort(numbers.begin(), numbers.end());
  const FrameWindow held{numbers.front(), numbers.back()};
  const auto asked = [&](int number) {
    return number >= first.value_or(held.first) && number <= last.value_or(held.last);
  };
  for (std::size_t i = 1; i < numbers.size(); ++i) {
    const int before = numbers[i - 1], after = numbers[i];
    if (after - before <= kMaxGap || !asked(before) || !asked(after)) continue;
    throw usage_error(path + ": no camera has a file between frames " + std::to_string(before) + " and " +
                      std::to_string(after) + ", expected gaps of at most " + std::to_string(kMaxGap) +
                      "; ask for frames on one side, or take the stray file away");
  }
  return held;
}

}  // namespace tactus
