#pragma once
/// Decides which clients may connect (ZAP, ZeroMQ RFC 27).
#include <atomic>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/live/wake_up.h"
#include "tactus/rig/live/zmq_io.h"

namespace tactus {

/// A thread that answers ZeroMQ's question about each connection: the key must be in the list, and the
/// connection gets the name that belongs to it. CURVE alone lets in every client that knows the server's
/// public key. Lives as long as the sockets of its context.
class LiveGate {
 public:
  LiveGate(const ZmqContext& context, const std::vector<LiveClient>& clients);
  ~LiveGate();
  LiveGate(const LiveGate&) = delete;
  LiveGate& operator=(const LiveGate&) = delete;
  /// Connections that were refused.
  std::int64_t refused() const { return refused_; }

 private:
  void answer();
  std::map<std::string, std::string> names_;  ///< by the 32 bytes of the key
  ZmqSocket socket_;
  WakeUp stop_;
  std::atomic<std::int64_t> refused_ = 0;
  std::thread thread_;  ///< last: it uses the others
};

}  // namespace tactus
