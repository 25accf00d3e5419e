#pragma once
/// The server's sockets, in a process of their own.
#include <sys/types.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/live/socket_link.h"

namespace tactus {

/// Settings of the sockets, sent to their process.
struct SocketSettings {
  std::string address;
  bool is_plain = false;            ///< without keys: no client is authenticated
  std::string secret_key;           ///< of the server
  std::vector<LiveClient> clients;  ///< clients that may connect
  std::int64_t most_bytes = 0;      ///< of a message; more ends its connection
  std::uint32_t most_waiting = 0;   ///< messages that were received and not asked for
};
std::string socket_settings_bytes(const SocketSettings& settings);
/// None for other bytes.
std::optional<SocketSettings> parse_socket_settings(std::string_view bytes);

/// Runs ZeroMQ's sockets in a child process, because libzmq answers its own faults with abort(): a fault must
/// not end the scene or its recording. The child is this program's file, started with one word that
/// socket_helper.cpp finds before main(). Once it ends, or says nothing for a second, another takes its place
/// on the same port; clients connect again by themselves. Messages on the way are lost.
///
/// One thread uses it. restarts() and refused_keys() are for all.
class SocketProcess {
 public:
  /// Waits until it listens. @throws Error when it can't.
  explicit SocketProcess(const SocketSettings& settings);
  ~SocketProcess();
  SocketProcess(const SocketProcess&) = delete;
  SocketProcess& operator=(const SocketProcess&) = delete;

  /// With the port that a wildcard became.
  const std::string& address() const { return settings_.address; }
  /// Readable when a message came; -1 while the process is being restarted.
  int fd() const { return link_ && link_->is_open() ? link_->fd() : -1; }
  /// @returns whether there was a message. Its views live until the next call.
  bool receive(LinkFrame& message);
  /// Says how many messages of receive() were looked at: as many more may come.
  void give_credit(std::uint32_t messages);
  /// Dropped when the sockets are away or don't keep up.
  void send(std::string_view identity, std::string_view bytes);
  /// Call it at least every 0.1 s. Starts the process again where that is needed.
  void tend(double now_s);

  std::int64_t restarts() const { return restarts_; }
  std::int64_t refused_keys() const { return refused_before_ + refused_now_; }
  pid_t pid() const { return pid_; }  ///< -1 while it is being restarted

 private:
  void start(double now_s);
  void end();
  std::string how_it_ended(int status) const;
  SocketSettings settings_;
  std::unique_ptr<SocketLink> link_;
  pid_t pid_ = -1;
  bool listens_ = false;
  double tended_s_ = 0, silent_s_ = 0, start_s_ = 0;
  std::string failure_, reported_failure_;
  std::atomic<std::int64_t> restarts_ = 0, refused_before_ = 0, refused_now_ = 0;
};

/// The one argument that makes a program the process of its sockets: looked for before main(). (A function,
/// so that a program that starts such a process links the code that looks for the argument.)
const char* socket_helper_word();
inline constexpr int kSocketHelperFd = 3;  ///< of the link, in that process

}  // namespace tactus
