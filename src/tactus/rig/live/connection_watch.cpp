#include "tactus/rig/live/connection_watch.h"

#include <linux/tcp.h>
#include <malloc.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <utility>

namespace tactus {
namespace {

constexpr rlim_t kLimitOverMost = 4;
constexpr int kMostDescriptors = 4096;
/// ZeroMQ frees a connection's memory on a thread of its own, in so many looks.
constexpr int kLooksToFree = 6;

/// Bytes that malloc has given out; 0 where it doesn't tell, as a sanitizer's. (Those that were given back
/// stay with the process for a while.)
std::size_t memory_in_use() {
#ifdef __GLIBC_PREREQ
#if __GLIBC_PREREQ(2, 33)
  const struct mallinfo2 info = ::mallinfo2();
  return info.uordblks + info.hblkhd;
#endif
#endif
  return 0;
}

/// Bytes that a TCP connection brought so far; 0 for other descriptors, and for sockets that listen.
std::uint64_t received_bytes(int fd) {
  tcp_info info{};
  socklen_t size = sizeof info;
  if (::getsockopt(fd, IPPROTO_TCP, TCP_INFO, &info, &size) != 0) return 0;
  if (size < offsetof(tcp_info, tcpi_bytes_received) + sizeof info.tcpi_bytes_received) return 0;
  return info.tcpi_bytes_received;
}

}  // namespace

ConnectionWatch::ConnectionWatch(std::size_t most_bytes) : most_bytes_(most_bytes) {
  if (memory_in_use() == 0) return;
  const rlimit limit{kLimitOverMost * most_bytes, kLimitOverMost * most_bytes};
  ::setrlimit(RLIMIT_DATA, &limit);
}

void ConnectionWatch::look() {
  if (looks_until_next_ > 0) --looks_until_next_;
  const bool is_full = memory_in_use() > most_bytes_;
  if (is_full && looks_until_next_ == 0) return end_greediest();
  if (is_full) return;
  received_bytes_.clear();
  if (std::exchange(has_ended_, false)) ::malloc_trim(0);
}

/// The first look above the limit learns how much each connection brought, the second tells which brings
/// most.
void ConnectionWatch::end_greediest() {
  std::map<int, std::uint64_t> now;
  int greediest = -1;
  std::uint64_t most = 0;
  for (int fd = 0; fd < kMostDescriptors; ++fd) {
    const std::uint64_t bytes = received_bytes(fd);
    if (bytes == 0) continue;
    now[fd] = bytes;
    const auto before = received_bytes_.find(fd);
    // A descriptor that brought less before is of another connection now.
    const std::uint64_t more =
        before == received_bytes_.end() || before->second > bytes ? bytes : bytes - before->second;
    if (!received_bytes_.empty() && more > most) {
      most = more;
      greediest = fd;
    }
  }
  received_bytes_ = std::move(now);
  if (greediest < 0) return;
  ::shutdown(greediest, SHUT_RDWR);
  received_bytes_.clear();
  has_ended_ = true;
  looks_until_next_ = kLooksToFree;
}

}  // namespace tactus
