#pragma once
/// Files that are numbered: "masks/%04d.png".
#include <optional>
#include <string>
#include <vector>

#include "tactus/rig/sources/frame_window.h"

namespace tactus {

/// Where the number of a path stands: its %d or %0Nd.
struct NumberPlace {
  std::size_t begin = 0, end = 0;
};
/// Other '%' belong to names. A path that is there as it is written has no number. Where a path has several
/// conversions, the last one counts whose folder is there, else the first.
std::optional<NumberPlace> number_place(const std::string& path);

/// A path with one %d or %0Nd in it, or without: then every number means the same file.
class NumberedFiles {
 public:
  /// @throws usage Error for another conversion than %d, of a file that is not there.
  explicit NumberedFiles(std::string pattern);
  bool is_sequence() const { return is_sequence_; }
  const std::string& pattern() const { return pattern_; }
  std::string file(int number) const;
  /// The numbers that have a file, ascending.
  /// @throws Error naming the pattern and the nearest name when no file matches, or a number above 10^9.
  std::vector<int> numbers() const;

 private:
  std::string pattern_, head_, tail_;
  std::size_t digits_ = 0;
  bool is_sequence_ = false;
};

/// Smallest and largest of some cameras' numbers between `first` and `last` (none: all there are). There may
/// be holes between, but no gap of more than 10,000 frames: a stray file would make a run walk through it.
/// @param numbers of at least one file, in any order
/// @throws usage Error naming `path` and the frames on both sides of the gap.
FrameWindow window_of(const std::string& path, std::vector<int> numbers, std::optional<int> first,
                      std::optional<int> last);

/// Whether a regular file, or anything at all, is there. False for a path that can't be looked at: a link
/// that leads to itself, a folder without permission. (std::filesystem's own throw.)
bool is_file(const std::string& path);
bool is_there(const std::string& path);

/// "; did you mean 'x'?" for the name in the path's folder that is nearest to the path's, or "".
std::string suggest_file(const std::string& path);

}  // namespace tactus
