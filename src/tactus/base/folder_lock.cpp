#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"

namespace tactus {

FolderLock::FolderLock(const std::string& folder) {
  const auto fail = [&](const std::string& why) { throw Error("output folder '" + folder + "': " + why); };
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) fail(error.message());
  path_ = (std::filesystem::path(folder) / kName).string();
  for (;;) {
    fd_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (fd_ < 0) fail(std::strerror(errno));
    if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
      const int error_number = errno;
      char pid[32] = {};
      const ssize_t n = ::pread(fd_, pid, sizeof pid - 1, 0);
      ::close(fd_);
      fd_ = -1;
      if (error_number != EWOULDBLOCK) fail(std::strerror(error_number));
      fail("another run" + (n > 0 ? " (process " + std::string(pid) + ")" : std::string()) +
           " writes into it; wait for its end or choose another folder");
    }
    // The last holder may have removed the file before we got its lock: then others see another file.
    struct stat ours {
    }, seen{};
    if (::fstat(fd_, &ours) == 0 && ::stat(path_.c_str(), &seen) == 0 && ours.st_ino == seen.st_ino &&
        ours.st_dev == seen.st_dev)
      break;
    ::close(fd_);
  }
  const std::string pid = std::to_string(::getpid());
  if (::ftruncate(fd_, 0) != 0 || ::pwrite(fd_, pid.data(), pid.size(), 0) < 0) {
    const int error_number = errno;
    ::unlink(path_.c_str());
    ::close(fd_);
    fail(std::strerror(error_number));
  }
}

FolderLock::~FolderLock() {
  ::unlink(path_.c_str());
  ::close(fd_);
}

}  // namespace tactus
