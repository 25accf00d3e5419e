#include "tactus/base/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"

namespace tactus {
namespace {

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

}  // namespace

std::string read_file(const std::string& path, std::uint64_t max_bytes, ReadFrom from) {
  const auto fail = [&](const std::string& why) {
    throw Error("can't read '" + printable(path) + "': " + why);
  };
  if (path.find('\0') != std::string::npos) fail("the path holds a zero byte");
  const bool regular_only = from == ReadFrom::regular_file;
  // Without O_NONBLOCK, opening a FIFO waits for a writer before its kind can be asked.
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | (regular_only ? O_NONBLOCK : 0)));
  if (file.get() < 0) fail(std::strerror(errno));
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) fail(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) fail(std::strerror(EISDIR));
  if (regular_only && !S_ISREG(status.st_mode)) fail("not a regular file");
  const std::string limit = ", expected at most " + bytes_text(static_cast<double>(max_bytes));
  std::string bytes;
  if (S_ISREG(status.st_mode)) {
    if (static_cast<std::uint64_t>(status.st_size) > max_bytes)
      fail("it has " + bytes_text(static_cast<double>(status.st_size)) + limit);
    bytes.reserve(static_cast<std::size_t>(status.st_size));
  }
  std::string block(std::size_t{1} << 16, '\0');
  for (;;) {
    const ssize_t n = ::read(file.get(), block.data(), block.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(std::strerror(errno));
    if (n == 0) return bytes;
    bytes.append(block.data(), static_cast<std::size_t>(n));
    if (bytes.size() > max_bytes) fail("it does not end" + limit);
  }
}

}  // namespace tactus
