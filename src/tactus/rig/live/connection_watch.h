#pragma once
/// Memory of the process that holds the sockets.
#include <cstddef>
#include <cstdint>
#include <map>

namespace tactus {

/// Ends connections that fill this process' memory. ZeroMQ keeps the parts of a message until its last one
/// came, however many they are, and a camera with a key can send parts for good. When the memory in use is
/// above its limit, the connection that brought most since the last look is ended. Should that not be enough,
/// the system refuses memory at four times the limit: ZeroMQ ends this process, and the server starts
/// another.
///
/// Call look() several times a second, in a process that has no other TCP connections.
class ConnectionWatch {
 public:
  /// @param most_bytes in use at most by all that is well
  explicit ConnectionWatch(std::size_t most_bytes);
  void look();

 private:
  void end_greediest();
  std::size_t most_bytes_;
  bool has_ended_ = false;  ///< a connection, whose memory malloc still keeps
  int looks_until_next_ = 0;
  std::map<int, std::uint64_t> received_bytes_;  ///< by descriptor
};

}  // namespace tactus
