#pragma once
/// A client of WebSocket for tests: blocking, on loopback.
#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tactus::test {

/// What came back: the status line's number, headers and body.
struct HttpAnswer {
  int status = 0;
  std::string head, body;
};

/// One request, to the end of the connection. @param headers more of them, each "Name: value"
HttpAnswer http_get(int port, const std::string& path, const std::vector<std::string>& headers = {},
                    const std::string& method = "GET");

class WsClient {
 public:
  /// Connects and upgrades; `status` tells how that went. @param receive_bytes of the kernel's buffer; 0: its
  /// own
  WsClient(int port, const std::string& path, const std::vector<std::string>& headers = {},
           int receive_bytes = 0);
  ~WsClient();
  WsClient(const WsClient&) = delete;
  WsClient& operator=(const WsClient&) = delete;

  int status() const { return status_; }
  bool is_open() const { return status_ == 101; }
  struct Message {
    bool is_binary = false;
    std::string bytes;
    friend bool operator==(const Message&, const Message&) = default;
  };
  /// The next message; none when the connection ended or nothing came in time.
  std::optional<Message> receive(double seconds = 5);
  /// @param first_byte FIN and opcode: 0x81 is a whole text
  void send(const std::string& payload, unsigned char first_byte = 0x81);
  /// Bytes as they are: whole messages or parts of one.
  void send_raw(const std::string& bytes);

 private:
  bool read_exactly(char* to, std::size_t bytes, std::chrono::steady_clock::time_point until);
  int fd_ = -1, status_ = 0;
};

}  // namespace tactus::test
