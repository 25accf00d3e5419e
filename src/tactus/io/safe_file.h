#pragma once
/// Files that are complete or not there: written beside the target, renamed at the end.
#include <cstdio>
#include <string>
#include <string_view>

namespace tactus {

/// Writes to `path.part`; `commit` renames it to `path`. Uncommitted files are removed.
class SafeFile {
 public:
  /// @throws Error naming the path and the system's reason.
  explicit SafeFile(const std::string& path);
  SafeFile(const SafeFile&) = delete;
  SafeFile& operator=(const SafeFile&) = delete;
  ~SafeFile();

  /// @throws Error (disk full, for example).
  void write(const void* data, std::size_t bytes);
  void write(std::string_view text) { write(text.data(), text.size()); }
  /// Makes the file visible under its name. @throws Error.
  void commit();

 private:
  [[noreturn]] void fail(int error_number) const;
  std::string path_, part_;
  std::FILE* file_ = nullptr;
};

/// Early check before long work: throws the Error that writing `path` would meet; changes nothing.
void output_is_writable(const std::string& path);

/// Whole contents of a file. @throws Error naming the path and the reason.
std::string read_text_file(const std::string& path);

}  // namespace tactus
