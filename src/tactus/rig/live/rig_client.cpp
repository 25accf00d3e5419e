#include "tactus/rig/live/rig_client.h"

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
#include "tactus/rig/live/live_message.h"
#include "tactus/rig/live/zmq_io.h"

namespace tactus {
namespace {

constexpr std::size_t kOnTheWay = 2;
/// A receipt that takes so much longer than those before won't come: the server ended, the connection broke,
/// or something on the way drops packets.
constexpr double kLostAfterWays = 4, kLeastLost_s = 0.05, kMostLost_s = 1;
constexpr double kHello_s = 0.5;
constexpr int kReconnect_ms = 100, kReconnectMost_ms = 500, kHeartbeat_ms = 1000, kSilence_ms = 3000;

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
  socket.set(ZMQ_SNDHWM, static_cast<int>(kOnTheWay));
  socket.set(ZMQ_MAXMSGSIZE, std::int64_t{1} << 20);
  socket.set(ZMQ_RECONNECT_IVL, kReconnect_ms);
  socket.set(ZMQ_RECONNECT_IVL_MAX, kReconnectMost_ms);
  socket.set(ZMQ_HEARTBEAT_IVL, kHeartbeat_ms);
  socket.set(ZMQ_HEARTBEAT_TIMEOUT, kSilence_ms);
}

std::uint64_t random_boot() {
  std::random_device device;
  return (std::uint64_t{device()} << 32) | device();
}

}  // namespace

/// Packets that have no receipt yet, oldest first.
class PacketsOnTheWay {
 public:
  bool has_room(double now_s) {
    while (!sent_.empty() && now_s - sent_.front().at_s > lost_after_s_) sent_.erase(sent_.begin());
    return sent_.size() < kOnTheWay;
  }
  void send(std::uint64_t sequence, double now_s) { sent_.push_back({sequence, now_s}); }
  /// Those before it are lost, or theirs are.
  void receive(std::uint64_t sequence, double now_s) {
    while (!sent_.empty() && sent_.front().sequence <= sequence) {
      way_s_ = std::max(now_s - sent_.front().at_s, 0.9 * way_s_);
      sent_.erase(sent_.begin());
    }
    lost_after_s_ = std::clamp(kLostAfterWays * way_s_, kLeastLost_s, kMostLost_s);
  }

 private:
  struct Sent {
    std::uint64_t sequence;
    double at_s;
  };
  std::vector<Sent> sent_;
  double way_s_ = 0, lost_after_s_ = kMostLost_s;  ///< there and back, the longest of late
};

struct RigClient::Impl {
  Impl(const LiveCamera& of, const std::string& address, const std::optional<LiveKey>& key)
      : camera(of), socket(context, ZMQ_DEALER) {
    if (key && key->name != of.name)
      throw usage_error("the key is camera '" + key->name + "'s, expected one of camera '" + of.name + "'");
    head.camera = of.name;
    head.calibration = of.calibration;
    head.boot = random_boot();
    set_keys(socket, address, key);
    socket.connect(address);
    thread = std::thread([this] { work(); });
  }
  ~Impl() {
    stops = true;
    wake.wake();
    thread.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void work();
  void receive();
  void send();

  LiveCamera camera;
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
  PacketsOnTheWay on_the_way;
  double last_hello_s = 0;

  ZmqContext context;
  ZmqSocket socket;
  WakeUp wake;
  std::atomic<bool> stops = false;
  std::thread thread;  ///< last: it uses the others
};

void RigClient::Impl::work() {
  while (!stops) {
    std::array<zmq_pollitem_t, 2> items{
        {{socket.get(), 0, ZMQ_POLLIN, 0}, {nullptr, wake.fd(), ZMQ_POLLIN, 0}}};
    zmq_poll(items.data(), static_cast<int>(items.size()), 20);
    wake.clear();
    receive();
    const double now = now_s();
    if (now - last_hello_s > kHello_s) {
      last_hello_s = now;
      socket.send(live_message_bytes({LiveMessage::kHello, 0, head.boot, camera.name}));
    }
    if (on_the_way.has_room(now)) send();
  }
}

void RigClient::Impl::receive() {
  for (ZmqMessage message; message.receive(socket);) {
    const auto m = parse_live_message(message.bytes());
    if (!m) continue;
    const std::lock_guard lock(mutex);
    if (m->kind == LiveMessage::kTrigger) {
      trigger = static_cast<std::int64_t>(m->number);
      has_trigger.notify_one();
    } else if (m->kind == LiveMessage::kReceipt && m->detail < static_cast<std::uint32_t>(Refusal::count)) {
      heard_s = now_s();
      on_the_way.receive(m->number, heard_s);
      if (m->detail == 0)
        ++status.taken;
      else
        ++status.refused[m->detail];
    }
  }
}

void RigClient::Impl::send() {
  {
    const std::lock_guard lock(mutex);
    if (!is_waiting) return;
    std::swap(waiting, sending);
    is_waiting = false;
    head.trigger = waiting_trigger;
    head.captured_s = waiting_captured_s;
    head.replaced = static_cast<std::uint32_t>(status.replaced);
  }
  ++head.sequence;
  head.sent_s = now_s();
  coder.pack(head, sending, packet);
  const bool sent = socket.send(packet);
  const std::lock_guard lock(mutex);
  if (sent) {
    on_the_way.send(head.sequence, head.sent_s);
    ++status.sent;
    return;
  }
  --head.sequence;  // nobody is there
  if (is_waiting) {
    ++status.replaced;
    return;
  }
  std::swap(waiting, sending);
  is_waiting = true;
}

RigClient::RigClient(const LiveCamera& camera, const std::string& address, const std::optional<LiveKey>& key)
    : impl_(std::make_unique<Impl>(camera, address, key)) {}
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
