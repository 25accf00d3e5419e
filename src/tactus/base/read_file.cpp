#include "tactus/base/read_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "tactus/base/compared_text.h"
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

void put_utf8(std::uint32_t c, std::string& to) {
  if (c < 0x80) {
    to += static_cast<char>(c);
    return;
  }
  const int more = c < 0x800 ? 1 : (c < 0x10000 ? 2 : 3);
  constexpr std::uint32_t kLead[] = {0, 0xc0, 0xe0, 0xf0};
  to += static_cast<char>(kLead[more] | c >> 6 * more);
  for (int i = more - 1; i >= 0; --i) to += static_cast<char>(0x80 | (c >> 6 * i & 0x3f));
}

/// Converts the text behind the byte order mark. Surrogates that lack their other half become U+FFFD.
std::string utf8_of_utf16(std::string_view bytes, bool little) {
  const auto unit = [&](std::size_t i) -> std::uint32_t {
    const auto a = static_cast<std::uint8_t>(bytes[i]), b = static_cast<std::uint8_t>(bytes[i + 1]);
    return little ? b << 8U | a : a << 8U | b;
  };
  std::string text;
  text.reserve(bytes.size() / 2);
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    std::uint32_t c = unit(i);
    const std::uint32_t next = i + 3 < bytes.size() ? unit(i + 2) : 0;
    if (c >= 0xd800 && c < 0xdc00 && next >= 0xdc00 && next < 0xe000) {
      c = 0x10000 + ((c - 0xd800) << 10U) + (next - 0xdc00);
      i += 2;
    } else if (c >= 0xd800 && c < 0xe000) {
      c = 0xfffd;
    }
    put_utf8(c, text);
  }
  return text;
}

}  // namespace

std::string read_file(const std::string& path, std::uint64_t max_bytes, ReadFrom from) {
  const auto fail = [&](const std::string& why) {
    throw Error("can't read '" + printable(path) + "': " + why);
  };
  if (path.find('\0') != std::string::npos) fail("the path holds a zero byte");
  const bool regular_only = from == ReadFrom::regular_file;
  // Without O_NONBLOCK, opening a FIFO waits for a writer before its kind can be asked.
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | (regular_only ? O_NONBLOCK : 0)));
  if (file.get() < 0) {
    // A shell replaces these; in a file they stand behind the file's own folder.
    const int error = errno;
    const std::string parts = "/" + path;
    const bool is_of_shell =
        error == ENOENT && (parts.find("/~/") != parts.npos || parts.find("/$") != parts.npos);
    fail(std::strerror(error) +
         std::string(is_of_shell ? "; '~' and '$' are a shell's: write the folder itself" : ""));
  }
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) fail(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) fail(std::strerror(EISDIR));
  if (regular_only && !S_ISREG(status.st_mode)) fail("not a regular file");
  const std::string limit = ", expected at most " + bytes_text(static_cast<double>(max_bytes));
  std::string bytes;
  if (S_ISREG(status.st_mode)) {
    if (static_cast<std::uint64_t>(status.st_size) > max_bytes)
      fail("it has " + bytes_text(static_cast<double>(status.st_size), static_cast<double>(max_bytes)) +
           limit);
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

std::string read_text(const std::string& path, std::uint64_t max_bytes, ReadFrom from) {
  std::string text = read_file(path, max_bytes, from);
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
  const bool little = text.starts_with("\xff\xfe");
  if (little || text.starts_with("\xfe\xff")) return utf8_of_utf16(std::string_view(text).substr(2), little);
  return text;
}

}  // namespace tactus
