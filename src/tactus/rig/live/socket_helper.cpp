// The process that holds a server's sockets (SocketProcess).
#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>
#include <cstring>

#include "tactus/base/byte_io.h"
#include "tactus/base/error.h"
#include "tactus/base/timing.h"
#include "tactus/rig/live/connection_watch.h"
#include "tactus/rig/live/live_gate.h"
#include "tactus/rig/live/socket_process.h"
#include "tactus/rig/live/zmq_io.h"

namespace tactus {
namespace {

/// Limits of connections that have not shown a key yet: time of the handshake, and how many wait.
constexpr int kHandshake_ms = 2000, kMostWaitingConnections = 64;
/// Packets of one camera that wait in ZeroMQ: more stay in its own mailbox, where the newest replaces them.
constexpr int kWaitingPackets = 4, kWaitingReceipts = 64;
constexpr double kBeat_s = 0.25;
/// Looks at the memory, and how much it may hold beside the messages that the server lets wait.
constexpr double kLook_s = 0.05;
constexpr std::size_t kOwnMemory = std::size_t{256} << 20;
constexpr long kMostSleep_ms = 50;
/// Most bytes of a frame of the server: its list of keys, or its status as JSON.
constexpr std::size_t kMostFromServer = 1 << 24;

class Sockets {
 public:
  Sockets(const SocketSettings& settings, SocketLink& link)
      : link_(link),
        socket_(context_, ZMQ_ROUTER),
        credit_(settings.most_waiting),
        watch_(kOwnMemory + settings.most_waiting * static_cast<std::size_t>(settings.most_bytes)) {
    if (!settings.is_plain) {
      gate_.emplace(context_, settings.clients);
      socket_.set(ZMQ_CURVE_SERVER, 1);
      socket_.set(ZMQ_CURVE_SECRETKEY, settings.secret_key);
    }
    socket_.set(ZMQ_HANDSHAKE_IVL, kHandshake_ms);
    socket_.set(ZMQ_BACKLOG, kMostWaitingConnections);
    socket_.set(ZMQ_RCVHWM, kWaitingPackets);
    socket_.set(ZMQ_SNDHWM, kWaitingReceipts);
    socket_.set(ZMQ_MAXMSGSIZE, settings.most_bytes);
    drop_dead_connections(socket_);
    socket_.bind(settings.address);
    link_.send({LinkFrame::listening, {}, {}, socket_.endpoint()});
  }
  /// Works until the server is gone. The system closes the descriptors that are open then.
  [[noreturn]] void work() {
    const pid_t server = ::getppid();
    while (link_.is_open() && ::getppid() == server) {
      const bool has_room = link_.waiting_bytes() == 0;
      const auto of_link = static_cast<short>(has_room ? ZMQ_POLLIN : ZMQ_POLLIN | ZMQ_POLLOUT);
      const auto of_socket = static_cast<short>(has_room && credit_ > 0 ? ZMQ_POLLIN : 0);
      zmq_pollitem_t items[] = {{nullptr, link_.fd(), of_link, 0}, {socket_.get(), 0, of_socket, 0}};
      zmq_poll(items, of_socket != 0 ? 2 : 1, kMostSleep_ms);
      hand_down();
      link_.flush();
      hand_up();
      if (now_s() - look_s_ > kLook_s) {
        watch_.look();
        look_s_ = now_s();
      }
      beat();
    }
    ::_exit(0);
  }

 private:
  /// Takes frames of the server: credit, and messages to cameras.
  void hand_down() {
    for (LinkFrame frame; link_.receive(frame);) {
      if (frame.kind == LinkFrame::credit)
        credit_ += ByteReader(frame.body).take<std::uint32_t>();
      else if (frame.kind == LinkFrame::message && socket_.send(frame.identity, true))
        socket_.send(frame.body);
    }
  }
  /// Hands messages of cameras to the server while it keeps up. (Connections take turns, so an honest one
  /// waits for one message of each other at most.)
  void hand_up() {
    while (credit_ > 0 && link_.is_open() && link_.waiting_bytes() == 0) {
      ZmqMessage identity, body;
      if (!identity.receive(socket_)) return;
      if (!identity.more() || !body.receive(socket_)) continue;
      --credit_;
      if (!body.more()) {
        link_.send({LinkFrame::message, identity.bytes(), body.user(), body.bytes()});
        continue;
      }
      bool more = true;
      for (ZmqMessage rest; more && rest.receive(socket_);) more = rest.more();
      link_.send({LinkFrame::message, identity.bytes(), {}, {}});  // no message of ours has two parts
    }
  }
  void beat() {
    if (now_s() - beat_s_ < kBeat_s || link_.waiting_bytes() > 0) return;
    beat_s_ = now_s();
    std::string refused;
    put_bytes(refused, static_cast<std::uint64_t>(gate_ ? gate_->refused() : 0));
    link_.send({LinkFrame::beat, {}, {}, refused});
  }

  SocketLink& link_;
  ZmqContext context_;
  std::optional<LiveGate> gate_;
  ZmqSocket socket_;
  std::uint64_t credit_;
  ConnectionWatch watch_;
  double beat_s_ = 0, look_s_ = 0;
};

void be_helper() {
  ::prctl(PR_SET_NAME, "tactus-sockets");
  // A signal of a terminal or service manager to all is for the server; its end ends us.
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) std::signal(signal, SIG_IGN);
  ::close_range(kSocketHelperFd + 1, ~0U, 0);
  SocketLink link(kSocketHelperFd, kMostFromServer);
  try {
    std::optional<SocketSettings> settings;
    for (LinkFrame frame; !settings && link.is_open(); ::usleep(1000)) {
      if (link.receive(frame)) settings = parse_socket_settings(frame.body);
    }
    if (settings) Sockets(*settings, link).work();
  } catch (const std::exception& error) {
    link.send({LinkFrame::failed, {}, {}, error.what()});
  }
}

/// The C library hands a program's arguments to constructors, too, which run before main().
__attribute__((constructor)) void before_main(int argc, char** argv) {
  if (argc != 2 || std::strcmp(argv[1], socket_helper_word()) != 0) return;
  be_helper();
  ::_exit(0);
}

}  // namespace

const char* socket_helper_word() { return "--tactus-live-sockets"; }

}  // namespace tactus
