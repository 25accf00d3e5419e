#include "rig/lossy_link.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>

#include "tactus/base/timing.h"

namespace tactus::test {
namespace {

constexpr std::size_t kSegmentBytes = 1448, kMostSegments = 4096;

sockaddr_in here(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int make_socket() {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), on = 1;
  if (fd < 0) throw std::runtime_error("no socket");
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return fd;
}

}  // namespace

LossyLink::LossyLink(const std::string& server, const LinkFaults& faults)
    : faults_(faults), server_port_(std::stoi(server.substr(server.rfind(':') + 1))) {
  listener_ = make_socket();
  sockaddr_in address = here(0);
  socklen_t size = sizeof address;
  if (::bind(listener_, reinterpret_cast<sockaddr*>(&address), size) != 0 || ::listen(listener_, 64) != 0 ||
      ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    throw std::runtime_error("no port");
  address_ = "tcp://127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  thread_ = std::thread([this] { work(); });
}

LossyLink::~LossyLink() {
  stops_ = true;
  thread_.join();
  for (const Connection& c : connections_) {
    ::close(c.lanes[0].from);
    ::close(c.lanes[0].to);
  }
  ::close(listener_);
}

void LossyLink::accept_one() {
  const int client = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) return;
  const int server = make_socket(), on = 1;
  ::setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  const sockaddr_in address = here(server_port_);
  if (::connect(server, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(client);
    ::close(server);
    return;
  }
  connections_.push_back({{Lane{client, server}, Lane{server, client}}});
}

void LossyLink::take(Connection& connection, Lane& lane, double now) {
  std::array<char, kSegmentBytes> bytes{};
  while (connection.is_open && lane.segments.size() < kMostSegments) {
    const ssize_t n = ::recv(lane.from, bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (n <= 0) {
      connection.is_open = false;
      return;
    }
    if (connection.is_forgotten) continue;
    ++segments_;
    double due_s = now + faults_.way_s + faults_.jitter_s * (2 * chance() - 1);
    if (chance() < faults_.lost) {
      ++lost_;
      due_s += faults_.again_s;
    }
    lane.last_due_s = std::max(lane.last_due_s, due_s);
    lane.segments.push_back({lane.last_due_s, std::string(bytes.data(), static_cast<std::size_t>(n))});
  }
}

void LossyLink::hand_on(Connection& connection, Lane& lane, double now) {
  while (connection.is_open && !lane.segments.empty() && lane.segments.front().due_s <= now) {
    std::string& bytes = lane.segments.front().bytes;
    const ssize_t n = ::send(lane.to, bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (n < 0) {
      connection.is_open = false;
      return;
    }
    bytes.erase(0, static_cast<std::size_t>(n));
    if (bytes.empty()) lane.segments.pop_front();
  }
}

void LossyLink::work() {
  std::vector<pollfd> items;
  while (!stops_) {
    items.assign(1, {listener_, POLLIN, 0});
    double next_s = now_s() + 0.02;
    for (const Connection& c : connections_) {
      for (const Lane& lane : c.lanes) {
        items.push_back({lane.from, POLLIN, 0});
        if (!lane.segments.empty()) next_s = std::min(next_s, lane.segments.front().due_s);
      }
    }
    const double wait_s = std::max(next_s - now_s(), 0.0);
    ::poll(items.data(), items.size(), static_cast<int>(1e3 * wait_s) + 1);
    if ((items[0].revents & POLLIN) != 0) accept_one();
    if (forgets_.exchange(false)) {
      for (Connection& c : connections_) {
        c.is_forgotten = true;
        for (Lane& lane : c.lanes) lane.segments.clear();
      }
    }
    const double now = now_s();
    for (auto c = connections_.begin(); c != connections_.end();) {
      for (Lane& lane : c->lanes) {
        take(*c, lane, now);
        hand_on(*c, lane, now);
      }
      if (c->is_open) {
        ++c;
        continue;
      }
      ::close(c->lanes[0].from);
      ::close(c->lanes[0].to);
      c = connections_.erase(c);
    }
  }
}

}  // namespace tactus::test
