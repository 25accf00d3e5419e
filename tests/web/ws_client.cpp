#include "web/ws_client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

namespace tactus::test {
namespace {

int connect_to(int port, int receive_bytes = 0) {
  const int fd = ::socket(AF_INET, SOCK_STREAM, 0);
  if (receive_bytes > 0) ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&to), sizeof to) == 0) return fd;
  ::close(fd);
  return -1;
}

std::string request_text(const std::string& method, int port, const std::string& path,
                         const std::vector<std::string>& headers) {
  std::string text = method + " " + path + " HTTP/1.1\r\n";
  bool has_host = false;
  for (const std::string& header : headers) {
    text += header + "\r\n";
    has_host = has_host || header.starts_with("Host:");
  }
  if (!has_host) text += "Host: 127.0.0.1:" + std::to_string(port) + "\r\n";
  return text + "\r\n";
}

void send_all(int fd, const std::string& bytes) {
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t sent = ::send(fd, bytes.data() + done, bytes.size() - done, MSG_NOSIGNAL);
    if (sent <= 0) return;
    done += static_cast<std::size_t>(sent);
  }
}

}  // namespace

HttpAnswer http_get(int port, const std::string& path, const std::vector<std::string>& headers,
                    const std::string& method) {
  HttpAnswer answer;
  const int fd = connect_to(port);
  if (fd < 0) return answer;
  send_all(fd, request_text(method, port, path, headers));
  std::string all;
  char part[4096];
  for (ssize_t got = 0; (got = ::recv(fd, part, sizeof part, 0)) > 0;)
    all.append(part, static_cast<std::size_t>(got));
  ::close(fd);
  const std::size_t end = all.find("\r\n\r\n");
  if (all.size() > 12) answer.status = std::atoi(all.c_str() + 9);
  answer.head = all.substr(0, end);
  if (end != all.npos) answer.body = all.substr(end + 4);
  return answer;
}

WsClient::WsClient(int port, const std::string& path, const std::vector<std::string>& headers,
                   int receive_bytes)
    : fd_(connect_to(port, receive_bytes)) {
  if (fd_ < 0) return;
  std::vector<std::string> all{"Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                               "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="};
  all.insert(all.end(), headers.begin(), headers.end());
  send_all(fd_, request_text("GET", port, path, all));
  std::string head;
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  for (char c = 0; !head.ends_with("\r\n\r\n") && read_exactly(&c, 1, until);) head += c;
  if (head.size() > 12) status_ = std::atoi(head.c_str() + 9);
}

WsClient::~WsClient() {
  if (fd_ >= 0) ::close(fd_);
}

bool WsClient::read_exactly(char* to, std::size_t bytes, std::chrono::steady_clock::time_point until) {
  while (bytes > 0) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(until - std::chrono::steady_clock::now())
            .count();
    pollfd waits{fd_, POLLIN, 0};
    if (left <= 0 || ::poll(&waits, 1, static_cast<int>(left)) <= 0) return false;
    const ssize_t got = ::recv(fd_, to, bytes, 0);
    if (got <= 0) return false;
    to += got;
    bytes -= static_cast<std::size_t>(got);
  }
  return true;
}

std::optional<WsClient::Message> WsClient::receive(double seconds) {
  const auto until =
      std::chrono::steady_clock::now() +
      std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(seconds));
  while (true) {
    unsigned char head[2], longer[8];
    if (!read_exactly(reinterpret_cast<char*>(head), 2, until)) return {};
    std::uint64_t size = head[1] & 0x7FU;
    const std::size_t more = size == 126 ? 2 : size == 127 ? 8 : 0;
    if (more > 0) {
      if (!read_exactly(reinterpret_cast<char*>(longer), more, until)) return {};
      size = 0;
      for (std::size_t i = 0; i < more; ++i) size = size << 8 | longer[i];
    }
    Message message;
    message.bytes.resize(size);
    if (!read_exactly(message.bytes.data(), size, until)) return {};
    const int opcode = head[0] & 0x0F;
    if (opcode == 8) return {};
    if (opcode == 9) continue;
    message.is_binary = opcode == 2;
    return message;
  }
}

void WsClient::send_raw(const std::string& bytes) { send_all(fd_, bytes); }

void WsClient::send(const std::string& payload, unsigned char first_byte) {
  std::string bytes{static_cast<char>(first_byte)};
  if (payload.size() < 126) {
    bytes += static_cast<char>(0x80 | payload.size());
  } else {
    bytes += static_cast<char>(0x80 | 126);
    bytes += static_cast<char>(payload.size() >> 8);
    bytes += static_cast<char>(payload.size() & 255);
  }
  bytes.append(4, '\0');  // a mask of zeros
  send_all(fd_, bytes + payload);
}

}  // namespace tactus::test
