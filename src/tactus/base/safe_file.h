#pragma once
/// Files that are complete or not there, and the lock on a folder that they are written to.
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace tactus {

/// A new, empty file in the folder of `target`, under a name that nobody can guess; it never follows a link.
/// For programs that write by name (video encoders); SafeFile is for everyone else. Removed unless committed.
class TemporaryFile {
 public:
  /// @param target a regular file, or none yet; links are followed
  /// @param extension of the temporary name: encoders choose by it
  /// @throws Error naming `target` and the reason.
  explicit TemporaryFile(const std::string& target, const std::string& extension = "");
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile();

  const std::string& path() const { return path_; }
  int fd() const { return fd_; }
  /// Waits until the bytes are on the disk, then gives the file its name. @throws Error.
  void commit();

 private:
  void close();
  std::string target_, final_, path_;
  int fd_ = -1, slot_ = -1;
};

/// Writes a file. A regular file is replaced at once by `commit`, or not at all. A device or a FIFO is
/// written to directly and never replaced. Links are followed; "-" is standard output.
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
  std::string path_;
  std::optional<TemporaryFile> temporary_;  ///< none: written to directly
  int fd_ = -1;
};

/// Writes all of it as one SafeFile. @throws Error.
void write_file(const std::string& path, std::string_view bytes);

/// Early check before long work: throws the Error that writing `path` would meet; changes nothing.
void output_is_writable(const std::string& path);

/// From now on, text printed to stdout goes to standard error: standard output belongs to SafeFile("-").
/// @throws usage Error the second time: two outputs would mix.
void reserve_standard_output();

/// Removes every TemporaryFile there is. For signal handlers that end the program.
void remove_temporary_files() noexcept;

/// Held by the one run that writes into a folder; the file `.tactus.lock` in it names the process.
class FolderLock {
 public:
  /// Makes the folder if needed. @throws Error naming folder and process when another run holds it.
  explicit FolderLock(const std::string& folder);
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();
  static constexpr const char* kName = ".tactus.lock";

 private:
  std::string path_;
  int fd_ = -1;
};

}  // namespace tactus
