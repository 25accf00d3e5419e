#pragma once
/// Messages between a server and the process that holds its sockets.
#include <cstdint>
#include <string>
#include <string_view>

namespace tactus {

/// One message. The views live until the next `receive` of their link.
struct LinkFrame {
  enum Kind : std::uint8_t {
    setup = 1,  ///< to the sockets: their address, and the clients that may connect
    listening,  ///< from them: `body` is the address
    failed,     ///< from them: `body` says why they can't
    message,    ///< of a connection, or to it; `user` is the name that its key is for
    beat,       ///< from them, four times a second: `body` counts refused keys (u64)
    credit,     ///< to them: so many more messages may come (u32)
    count
  };
  Kind kind = message;
  std::string_view identity, user, body;
};

/// Sends and receives frames over a connected socket of this computer. Never waits. A frame is
///
///   bytes that follow (u32), kind (u8), bytes of the identity (u8), of the user (u8), identity, user, body
///
/// Bytes of any other form close the link. One thread uses it.
class SocketLink {
 public:
  /// @param fd its owner is the link from now on @param most_bytes of a frame that comes
  SocketLink(int fd, std::size_t most_bytes) : fd_(fd), most_bytes_(most_bytes) {}
  ~SocketLink();
  SocketLink(const SocketLink&) = delete;
  SocketLink& operator=(const SocketLink&) = delete;

  int fd() const { return fd_; }
  /// False once the other end is gone.
  bool is_open() const { return is_open_; }
  /// Appends a frame to the bytes that wait, and sends those that can be sent now.
  void send(const LinkFrame& frame);
  void flush();
  std::size_t waiting_bytes() const { return out_.size() - sent_; }
  /// @returns whether there was a whole frame.
  bool receive(LinkFrame& frame);

 private:
  bool parse(LinkFrame& frame);
  bool read_more();
  int fd_;
  std::size_t most_bytes_;
  bool is_open_ = true;
  std::string out_, in_;
  std::size_t sent_ = 0;                         ///< of out_
  std::size_t begin_ = 0, end_ = 0, taken_ = 0;  ///< of in_: bytes read, and the last frame's
};

}  // namespace tactus
