#include "tactus/rig/live.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "tactus/base/error.h"
#include "tactus/base/timing.h"
#include "tactus/rig/live/client_connection.h"
#include "tactus/rig/live/live_message.h"
#include "tactus/rig/live/wake_up.h"
#include "tactus/rig/live/zmq_io.h"
#include "tactus/rig/live_address.h"
#include "tactus/rig/wire/packet.h"

namespace tactus {
namespace {

constexpr double kHello_s = 0.5;
constexpr int kReconnect_ms = 100, kReconnectMost_ms = 500;
/// A connection that takes packets and brings nothing back for so long is made anew.
constexpr double kSilence_s = 3;
constexpr int kIdle_ms = 20;

void set_keys(ZmqSocket& socket, const std::string& address, const std::optional<LiveKey>& key) {
  if (!key && !is_loopback(address))
    throw usage_error("'" + address + "' is another computer; without a key, expected tcp://127.0.0.1:PORT");
  if (key) {
    if (key->server_key.empty())
      throw Error("the key of '" + key->name +
                  "' names no server; expected one that 'tactus keys' made for a camera");
    socket.set(ZMQ_CURVE_SERVERKEY, key->server_key);
    socket.set(ZMQ_CURVE_PUBLICKEY, key->public_key);
    socket.set(ZMQ_CURVE_SECRETKEY, key->secret_key);
  }
  socket.set(ZMQ_IMMEDIATE, 1);
  socket.set(ZMQ_SNDHWM, static_cast<int>(PacketsOnTheWay::kMost));
  socket.set(ZMQ_MAXMSGSIZE, std::int64_t{1} << 20);
  socket.set(ZMQ_RECONNECT_IVL, kReconnect_ms);
  socket.set(ZMQ_RECONNECT_IVL_MAX, kReconnectMost_ms);
  drop_dead_connections(socket);
}

std::uint64_t random_boot() {
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

}  // namespace

/// One of a client's.
struct ClientConnection {
  ClientConnection(const ZmqContext& context, const std::string& address, const std::optional<LiveKey>& key)
      : socket(context, ZMQ_DEALER) {
    set_keys(socket, address, key);
    socket.connect(address);
  }
  ZmqSocket socket;
  PacketsOnTheWay on_the_way;
  double hello_s = 0;
  double unanswered_s = 0;  ///< since when it took packets and brought nothing; 0: it is answered
};

struct RigClient::Impl {
  Impl(const LiveCamera& of, const std::string& to, const std::optional<LiveKey>& with, int most)
      : camera(of), address(to), key(with), most_connections(static_cast<std::size_t>(most)) {
    if (key && key->name != of.name)
      throw usage_error("the key is camera '" + key->name + "'s, expected one of camera '" + of.name + "'");
    head.camera = of.name;
    head.calibration = of.calibration;
    head.boot = random_boot();
    connect_one_more();
    thread = std::thread([this] { work(); });
  }
  ~Impl() {
    stops = true;
    wake.wake();
    thread.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void connect_one_more() {
    connections.push_back(std::make_unique<ClientConnection>(context, address, key));
  }
  void work();
  void receive(ClientConnection& from);
  void greet(ClientConnection& to, double now_s);
  std::vector<ClientConnection*> best(double now_s);
  void send(double now_s);

  LiveCamera camera;
  std::string address;
  std::optional<LiveKey> key;
  std::size_t most_connections;
  mutable std::mutex mutex;
  std::condition_variable has_trigger;
  CameraImages waiting, sending;
  bool is_waiting = false;
  std::int64_t waiting_trigger = 0;
  double waiting_captured_s = 0, heard_s = 0;
  std::optional<std::int64_t> trigger;
  Status status;

  PacketHead head;
  PacketCoder coder;
  std::string packet;
  CopyRule copies;

  ZmqContext context;
  std::vector<std::unique_ptr<ClientConnection>> connections;
  WakeUp wake;
  std::atomic<double> woken_s = 0;  ///< by images that nobody has looked for yet; 0: none
  std::atomic<bool> stops = false;
  std::thread thread;  ///< last: it uses the others
};

void RigClient::Impl::work() {
  std::vector<zmq_pollitem_t> items;
  while (!stops) {
    items.assign(1, {nullptr, wake.fd(), ZMQ_POLLIN, 0});
    for (const auto& c : connections) items.push_back({c->socket.get(), 0, ZMQ_POLLIN, 0});
    const double idle_until_s = now_s() + 1e-3 * kIdle_ms;
    zmq_poll(items.data(), static_cast<int>(items.size()), kIdle_ms);
    wake.clear();
    const double woken = woken_s.exchange(0), now = now_s();
    copies.woke(woken > 0 ? std::min(woken, idle_until_s) : idle_until_s, now);
    for (const auto& c : connections) receive(*c);
    for (const auto& c : connections) greet(*c, now);
    if (copies.is_on(now) && connections.size() < most_connections) connect_one_more();
    send(now);
  }
}

void RigClient::Impl::greet(ClientConnection& to, double now) {
  if (to.unanswered_s > 0 && now - to.unanswered_s > kSilence_s) {
    to.socket.disconnect(address);
    to.socket.connect(address);
    to.on_the_way.clear();
    to.unanswered_s = 0;
  }
  if (now - to.hello_s <= kHello_s) return;
  to.hello_s = now;
  to.socket.send(live_message_bytes({LiveMessage::kHello, 0, head.boot, camera.name}));
}

void RigClient::Impl::receive(ClientConnection& from) {
  for (ZmqMessage message; message.receive(from.socket);) {
    const auto m = parse_live_message(message.bytes());
    if (!m) continue;
    from.unanswered_s = 0;
    const std::lock_guard lock(mutex);
    if (m->kind == LiveMessage::kTrigger) {
      trigger = static_cast<std::int64_t>(m->number);
      has_trigger.notify_one();
    } else if (m->kind == LiveMessage::kReceipt && m->detail < static_cast<std::uint32_t>(Refusal::count)) {
      heard_s = now_s();
      const PacketsOnTheWay::Receipt receipt = from.on_the_way.receive(m->number, heard_s);
      if (receipt.is_late) copies.late(receipt.sent_s, heard_s);
      const bool is_late = receipt.is_late || receipt.sent_s == 0;
      const bool is_copy = copies.receive(m->number, is_late, heard_s) || receipt.is_copy;
      const auto why = static_cast<Refusal>(m->detail);
      if (why == Refusal::too_much || why == Refusal::too_many) copies.refused(heard_s);
      if (why == Refusal::none)
        ++status.taken;
      else if (why != Refusal::repeated || !is_copy)
        ++status.refused[m->detail];
    }
  }
}

/// Those that may take a packet, the one that is least likely to stand still first.
std::vector<ClientConnection*> RigClient::Impl::best(double now) {
  std::vector<ClientConnection*> with_room;
  for (const auto& c : connections) {
    if (c->on_the_way.has_room(now)) with_room.push_back(c.get());
    const PacketsOnTheWay::Lost lost = c->on_the_way.take_lost();
    for (int k = 0; k < lost.count; ++k) copies.late(lost.sent_s, now);
  }
  std::stable_sort(with_room.begin(), with_room.end(),
                   [&](const ClientConnection* a, const ClientConnection* b) {
                     return a->on_the_way.age_s(now) < b->on_the_way.age_s(now);
                   });
  return with_room;
}

void RigClient::Impl::send(double now) {
  std::vector<ClientConnection*> to = best(now);
  if (to.empty()) return;
  {
    const std::lock_guard lock(mutex);
    if (!is_waiting) return;
    std::swap(waiting, sending);
    is_waiting = false;
    head.trigger = waiting_trigger;
    head.captured_s = waiting_captured_s;
    head.replaced = static_cast<std::uint32_t>(status.replaced);
  }
  const std::size_t most = copies.is_on(now) ? std::min<std::size_t>(2, to.size()) : 1;
  ++head.sequence;
  head.sent_s = now_s();
  head.copies = static_cast<std::uint8_t>(most);
  if (most > 1) copies.send(head.sequence);
  coder.pack(head, sending, packet);
  std::size_t sent = 0;
  for (auto c = to.begin(); c != to.end() && sent < most; ++c) {
    if (!(*c)->socket.send(packet)) continue;  // nobody is there
    ++sent;
    (*c)->on_the_way.send(head.sequence, most > 1, head.sent_s);
    if ((*c)->unanswered_s == 0) (*c)->unanswered_s = head.sent_s;
  }
  const std::lock_guard lock(mutex);
  if (sent > 0) {
    ++status.sent;
    status.copies += static_cast<std::int64_t>(sent) - 1;
    return;
  }
  --head.sequence;
  if (is_waiting) {
    ++status.replaced;
    return;
  }
  std::swap(waiting, sending);
  is_waiting = true;
}

RigClient::RigClient(const LiveCamera& camera, const std::string& address, const std::optional<LiveKey>& key,
                     int most_connections)
    : impl_(std::make_unique<Impl>(camera, address, key, most_connections)) {}
RigClient::~RigClient() = default;

void RigClient::put(CameraImages& images, std::int64_t trigger, double captured_s) {
  Impl& m = *impl_;
  {
    const std::lock_guard lock(m.mutex);
    if (m.is_waiting) ++m.status.replaced;
    std::swap(m.waiting, images);
    m.is_waiting = true;
    m.waiting_trigger = trigger;
    m.waiting_captured_s = captured_s;
  }
  double none = 0;
  m.woken_s.compare_exchange_strong(none, now_s());
  m.wake.wake();
}

std::optional<std::int64_t> RigClient::wait_trigger(double until_s) {
  Impl& m = *impl_;
  std::unique_lock lock(m.mutex);
  const std::chrono::duration<double> most(std::max(until_s - now_s(), 0.0));
  m.has_trigger.wait_for(lock, most, [&] { return m.trigger.has_value(); });
  return std::exchange(m.trigger, {});
}

RigClient::Status RigClient::status() const {
  const std::lock_guard lock(impl_->mutex);
  Status status = impl_->status;
  status.is_heard = impl_->heard_s > 0 && now_s() - impl_->heard_s < 1;
  return status;
}

std::optional<std::string> ask_live_status(const std::string& address, const std::optional<LiveKey>& key,
                                           double seconds) {
  const ZmqContext context;
  ZmqSocket socket(context, ZMQ_DEALER);
  set_keys(socket, address, key);
  socket.connect(address);
  const double until_s = now_s() + seconds;
  bool asked = false;
  while (now_s() < until_s) {
    asked = asked || socket.send(live_message_bytes({LiveMessage::kAsk, 0, 0, {}}));
    zmq_pollitem_t item{socket.get(), 0, ZMQ_POLLIN, 0};
    zmq_poll(&item, 1, 20);
    ZmqMessage answer;
    if (answer.receive(socket)) return std::string(answer.bytes());
  }
  return {};
}

}  // namespace tactus
