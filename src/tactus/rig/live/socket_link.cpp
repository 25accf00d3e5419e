#include "tactus/rig/live/socket_link.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tactus/base/byte_io.h"

namespace tactus {
namespace {

constexpr std::size_t kLengthBytes = 4, kHeadBytes = 3, kReadBytes = 1 << 16;

}  // namespace

SocketLink::~SocketLink() { ::close(fd_); }

void SocketLink::send(const LinkFrame& frame) {
  const std::string_view identity = frame.identity.substr(0, 255), user = frame.user.substr(0, 255);
  put_bytes(out_, static_cast<std::uint32_t>(kHeadBytes + identity.size() + user.size() + frame.body.size()));
  put_bytes(out_, frame.kind);
  put_bytes(out_, static_cast<std::uint8_t>(identity.size()));
  put_bytes(out_, static_cast<std::uint8_t>(user.size()));
  out_.append(identity).append(user).append(frame.body);
  flush();
}

void SocketLink::flush() {
  while (is_open_ && sent_ < out_.size()) {
    const ssize_t n = ::send(fd_, out_.data() + sent_, out_.size() - sent_, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) return;
    if (n < 0) is_open_ = false;
    sent_ += n < 0 ? 0 : static_cast<std::size_t>(n);
  }
  out_.clear();
  sent_ = 0;
}

bool SocketLink::parse(LinkFrame& frame) {
  ByteReader in(std::string_view(in_).substr(begin_, end_ - begin_));
  const auto bytes = in.take<std::uint32_t>();
  if (in.failed()) return false;
  if (bytes < kHeadBytes || bytes > most_bytes_) {
    is_open_ = false;
    return false;
  }
  if (in.left() < bytes) return false;
  ByteReader of(in.take(bytes));
  const auto kind = of.take<std::uint8_t>(), identity = of.take<std::uint8_t>(),
             user = of.take<std::uint8_t>();
  frame.kind = static_cast<LinkFrame::Kind>(kind);
  frame.identity = of.take(identity);
  frame.user = of.take(user);
  frame.body = of.take(of.left());
  if (of.failed() || kind < LinkFrame::setup || kind >= LinkFrame::count) is_open_ = false;
  taken_ = kLengthBytes + bytes;
  return is_open_;
}

bool SocketLink::read_more() {
  std::size_t need = kLengthBytes;
  if (end_ - begin_ >= kLengthBytes) {
    std::uint32_t bytes = 0;
    std::memcpy(&bytes, in_.data() + begin_, sizeof bytes);
    need += bytes;  // parse() has checked it
  }
  if (begin_ > 0) std::memmove(in_.data(), in_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  if (in_.size() < need + kReadBytes) in_.resize(need + kReadBytes);
  ssize_t n = 0;
  do {
    n = ::recv(fd_, in_.data() + end_, in_.size() - end_, MSG_DONTWAIT);
  } while (n < 0 && errno == EINTR);
  if (n > 0) {
    end_ += static_cast<std::size_t>(n);
    return true;
  }
  if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) is_open_ = false;
  return false;
}

bool SocketLink::receive(LinkFrame& frame) {
  begin_ += taken_;
  taken_ = 0;
  while (is_open_) {
    if (parse(frame)) return true;
    if (!is_open_ || !read_more()) return false;
  }
  return false;
}

}  // namespace tactus
