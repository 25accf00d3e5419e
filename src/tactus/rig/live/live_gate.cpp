#include "tactus/rig/live/live_gate.h"

#include <array>

namespace tactus {
namespace {

/// Parts of a request: version, id, domain, address, identity, mechanism, key.
enum Part : std::size_t { kVersion = 0, kRequest = 1, kMechanism = 5, kKey = 6, kParts = 7 };

}  // namespace

LiveGate::LiveGate(const ZmqContext& context, const std::vector<LiveClient>& clients)
    : socket_(context, ZMQ_REP) {
  for (const LiveClient& client : clients) {
    std::array<std::uint8_t, 32> bytes{};
    zmq_z85_decode(bytes.data(), client.public_key.c_str());
    names_[std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())] = client.name;
  }
  socket_.bind("inproc://zeromq.zap.01");
  thread_ = std::thread([this] { answer(); });
}

LiveGate::~LiveGate() {
  stop_.wake();
  thread_.join();
}

void LiveGate::answer() {
  for (;;) {
    std::array<zmq_pollitem_t, 2> items{
        {{socket_.get(), 0, ZMQ_POLLIN, 0}, {nullptr, stop_.fd(), ZMQ_POLLIN, 0}}};
    if (zmq_poll(items.data(), static_cast<int>(items.size()), -1) < 0) continue;
    if (items[1].revents != 0) return;
    std::array<std::string, kParts> parts;
    std::size_t count = 0;
    for (bool more = true; more; ++count) {
      ZmqMessage part;
      if (!part.receive(socket_)) break;
      if (count < kParts) parts[count] = part.bytes();
      more = part.more();
    }
    const auto known = parts[kMechanism] == "CURVE" ? names_.find(parts[kKey]) : names_.end();
    const bool ok = known != names_.end();
    if (!ok) ++refused_;
    socket_.send("1.0", true);
    socket_.send(parts[kRequest], true);
    socket_.send(ok ? "200" : "400", true);
    socket_.send(ok ? "OK" : "this key is not in the list", true);
    socket_.send(ok ? known->second : "", true);
    socket_.send("");
  }
}

}  // namespace tactus
