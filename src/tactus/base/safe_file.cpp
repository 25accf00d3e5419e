#include "tactus/base/safe_file.h"

#include <fcntl.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <utility>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& path, const std::string& why) {
  throw Error("can't write '" + printable(path) + "': " + why);
}

std::string folder_of(const std::string& path) {
  const fs::path folder = fs::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

/// The system's reason. Where the folder is at fault, the message names the folder.
[[noreturn]] void fail(const std::string& path, int error_number) {
  const std::string folder = folder_of(path);
  std::error_code ignored;
  if (error_number == ENOENT && !fs::exists(folder, ignored))
    fail(path, "the folder '" + folder + "' does not exist");
  if (error_number == ENOTDIR) fail(path, "'" + folder + "' is not a folder");
  if (error_number == EISDIR) fail(path, "it is a folder");
  fail(path, std::strerror(error_number));
}

/// Where the links of a path end, whether or not there is a file.
std::string follow_links(const std::string& path) {
  std::string at = path;
  for (int i = 0; i < 40; ++i) {
    std::error_code error;
    const fs::path next = fs::read_symlink(at, error);
    if (error) return at;
    at = (fs::path(at).parent_path() / next).string();  // an absolute target replaces the folder
  }
  fail(path, ELOOP);
}

/// Kind of file that a path names, links followed.
enum class Target { none, regular, other };
Target target_of(const std::string& path) {
  if (path.empty()) fail(path, "the path is empty");
  if (path.find('\0') != std::string::npos) fail(path, "the path holds a zero byte");
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    if (errno == ENOENT) return Target::none;
    fail(path, errno);
  }
  if (S_ISDIR(status.st_mode)) fail(path, EISDIR);
  return S_ISREG(status.st_mode) ? Target::regular : Target::other;
}

/// Names of the temporary files that exist, in memory that a signal handler may read.
struct Slot {
  std::atomic<bool> taken{false}, exists{false};
  char path[PATH_MAX];
};
Slot slots[64];

int register_name(const std::string& path) {
  for (int i = 0; i < static_cast<int>(std::size(slots)); ++i) {
    if (path.size() >= sizeof slots[i].path || slots[i].taken.exchange(true)) continue;
    std::memcpy(slots[i].path, path.c_str(), path.size() + 1);
    slots[i].exists = true;
    return i;
  }
  return -1;  // more files at once than slots: such a one stays if the program is ended
}

std::string random_name(const std::string& extension) {
  std::uint64_t random = 0;
  if (::getrandom(&random, sizeof random, 0) != sizeof random) fail(extension, errno);
  char text[48];
  std::snprintf(text, sizeof text, ".tactus-%016llx.part", static_cast<unsigned long long>(random));
  return text + extension;
}

int standard_output = STDOUT_FILENO;
bool is_reserved = false;

}  // namespace

TemporaryFile::TemporaryFile(const std::string& target, const std::string& extension)
    : target_(target), final_(follow_links(target)) {
  if (target_of(target) == Target::other) fail(target, "it is no regular file");
  const fs::path folder = fs::path(final_).parent_path();
  do {  // 64 random bits: a second turn is a matter of principle
    path_ = (folder / random_name(extension)).string();
    fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666);
  } while (fd_ < 0 && (errno == EEXIST || errno == EINTR));
  if (fd_ < 0) fail(target_, errno);
  slot_ = register_name(path_);
}

TemporaryFile::~TemporaryFile() {
  if (fd_ < 0) return;
  ::unlink(path_.c_str());
  close();
}

void TemporaryFile::close() {
  ::close(fd_);
  fd_ = -1;
  if (slot_ < 0) return;
  slots[slot_].exists = false;
  slots[slot_].taken = false;
}

void TemporaryFile::commit() {
  struct stat old {};
  if (::stat(final_.c_str(), &old) == 0) ::fchmod(fd_, old.st_mode & 0777U);  // readers stay readers
  // Some file systems have no fsync and say so; that is no failure of ours.
  if (::fsync(fd_) != 0 && errno != EINVAL && errno != ENOSYS && errno != ENOTSUP) fail(target_, errno);
  if (::rename(path_.c_str(), final_.c_str()) != 0) fail(target_, errno);
  close();
}

SafeFile::SafeFile(const std::string& path) : path_(path) {
  if (path_ == "-") {
    fd_ = standard_output;
  } else if (target_of(path_) == Target::other) {
    fd_ = ::open(path_.c_str(), O_WRONLY | O_NOCTTY | O_CLOEXEC);
    if (fd_ < 0) fail(path_, errno);
  } else {
    temporary_.emplace(path_);
    fd_ = temporary_->fd();
  }
}

SafeFile::~SafeFile() {
  if (!temporary_ && path_ != "-" && fd_ >= 0) ::close(fd_);
}

void SafeFile::write(const void* data, std::size_t bytes) {
  const auto* at = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t n = ::write(fd_, at, bytes);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(path_, errno);
    at += n;
    bytes -= static_cast<std::size_t>(n);
  }
}

void SafeFile::commit() {
  if (temporary_) return temporary_->commit();
  if (path_ == "-") return;
  const int fd = std::exchange(fd_, -1);
  if (::close(fd) != 0) fail(path_, errno);
}

void write_file(const std::string& path, std::string_view bytes) {
  SafeFile file(path);
  file.write(bytes);
  file.commit();
}

void output_is_writable(const std::string& path) {
  if (path == "-") return;
  if (target_of(path) == Target::other) {
    if (::access(path.c_str(), W_OK) != 0) fail(path, errno);  // opening a FIFO would tell its reader
    return;
  }
  const TemporaryFile probe(path);
}

void reserve_standard_output() {
  if (std::exchange(is_reserved, true))
    throw usage_error("'-' (standard output) is given for two outputs, expected a file for one of them");
  std::fflush(stdout);
  standard_output = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  if (standard_output < 0 || ::dup2(STDERR_FILENO, STDOUT_FILENO) < 0) fail("-", errno);
}

void remove_temporary_files() noexcept {
  for (const Slot& slot : slots) {
    if (slot.exists) ::unlink(slot.path);
  }
}

}  // namespace tactus
