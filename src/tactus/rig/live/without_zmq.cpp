// Live rigs in a build without ZeroMQ: the same error everywhere.
#include "tactus/base/error.h"
#include "tactus/rig/live.h"
#include "tactus/rig/live/live_keys.h"

namespace tactus {
namespace {

[[noreturn]] void refuse() {
  throw Error("live rigs need " + live_missing() + "; install it and build again");
}

}  // namespace

std::string live_missing() { return "ZeroMQ (libzmq3-dev): no live cameras"; }

LiveKey make_live_key(const std::string&, const std::string&) { refuse(); }
void write_live_key(const std::string&, const LiveKey&) { refuse(); }
LiveKey read_live_key(const std::string&) { refuse(); }
void write_live_clients(const std::string&, const std::vector<LiveClient>&) { refuse(); }
std::vector<LiveClient> read_live_clients(const std::string&) { refuse(); }
std::string live_key_path(const std::string&, const std::string&) { refuse(); }
std::string live_clients_path(const std::string&) { refuse(); }

struct RigServer::Impl {};
RigServer::RigServer(const std::vector<LiveCamera>&, const LiveSettings&, const std::optional<Keys>&) {
  refuse();
}
RigServer::~RigServer() = default;
std::string RigServer::address() const { refuse(); }
bool RigServer::wait(LiveSet&, double) { refuse(); }
LiveStatus RigServer::status() const { refuse(); }
std::int64_t RigServer::socket_restarts() const { refuse(); }

struct RigClient::Impl {};
RigClient::RigClient(const LiveCamera&, const std::string&, const std::optional<LiveKey>&, int) { refuse(); }
RigClient::~RigClient() = default;
void RigClient::put(CameraImages&, std::int64_t, double) { refuse(); }
std::optional<std::int64_t> RigClient::wait_trigger(double) { refuse(); }
RigClient::Status RigClient::status() const { refuse(); }
std::optional<std::string> ask_live_status(const std::string&, const std::optional<LiveKey>&, double) {
  refuse();
}

}  // namespace tactus
