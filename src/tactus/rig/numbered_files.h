#pragma once
/// Files that are numbered: "masks/%04d.png".
#include <optional>
#include <string>

#include "tactus/rig/frame_window.h"

namespace tactus {

/// A path with one %d or %0Nd in it, or without: then every number means the same file.
class NumberedFiles {
 public:
  /// @throws usage Error for another conversion than %d.
  explicit NumberedFiles(std::string pattern);
  bool is_sequence() const { return is_sequence_; }
  const std::string& pattern() const { return pattern_; }
  std::string file(int number) const;
  /// Smallest and largest number that has a file; there may be holes between.
  /// @throws Error naming the pattern and the nearest name when no file matches.
  FrameWindow range() const;

 private:
  std::string pattern_, head_, tail_;
  std::size_t digits_ = 0;
  bool is_sequence_ = false;
};

/// "; did you mean 'x'?" for the name in the path's folder that is nearest to the path's, or "".
std::string suggest_file(const std::string& path);

}  // namespace tactus
