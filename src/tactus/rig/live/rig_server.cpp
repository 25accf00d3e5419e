#include "tactus/rig/live.h"

#include <poll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/timing.h"
#include "tactus/rig/live/camera_gate.h"
#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/live/live_message.h"
#include "tactus/rig/live/socket_process.h"
#include "tactus/rig/live/wake_up.h"
#include "tactus/rig/live_address.h"
#include "tactus/rig/wire/set_assembler.h"

namespace tactus {
namespace {

/// A packet above a camera's limit is counted; a message above this ends the connection.
constexpr std::int64_t kMostOverLimit = 2;
/// Messages a second that are read without a pause: of strangers, and of each camera a frame.
constexpr double kStrangers_1_s = 2000, kPerFrame = 8;
/// Questions for the status that are answered, a second.
constexpr double kMostAsked_1_s = 100;
constexpr std::chrono::milliseconds kFloodPause{2};
/// Packets of another client: a client that was started anew sends fewer before its predecessor counts as
/// silent.
constexpr std::int64_t kSecondClientAfter = 30;
/// From one event to the next the thread sleeps at most so long.
constexpr double kMostSleep_s = 0.1;

SetAssembler::Options assembler_options(const std::vector<LiveCamera>& cameras,
                                        const LiveSettings& settings) {
  SetAssembler::Options options;
  options.cameras = static_cast<int>(cameras.size());
  options.period_s = 1 / settings.fps;
  options.deadline_s = settings.deadline_s;
  options.by_trigger = settings.sync != LiveSync::time;
  return options;
}

void check_names(const std::vector<LiveCamera>& cameras) {
  for (const LiveCamera& camera : cameras) {
    if (camera.name.empty() || camera.name.size() > PacketHead::kMostNameBytes ||
        camera.name.find_first_of(std::string_view(" \t\n\0", 4)) != std::string::npos)
      throw usage_error("camera '" + camera.name + "': expected a name of 1 to " +
                        std::to_string(PacketHead::kMostNameBytes) +
                        " bytes without spaces, as packets hold it");
  }
}

}  // namespace

struct RigServer::Impl {
  Impl(const std::vector<LiveCamera>& cameras, const LiveSettings& live, const std::optional<Keys>& keys)
      : settings(live),
        is_plain(!keys),
        assembler(assembler_options(cameras, live)),
        intake(kStrangers_1_s + kPerFrame * live.fps * static_cast<double>(cameras.size())) {
    check_names(cameras);
    if (is_plain && !is_loopback(live.address))
      throw usage_error(
          "'" + live.address +
          "' can be reached from other computers; without keys, expected an address of this one: "
          "tcp://127.0.0.1:PORT");
    std::size_t limit = 0;
    for (const LiveCamera& camera : cameras) {
      gates.emplace_back(camera, live);
      limit = std::max(limit, packet_limit(camera.size_px));
    }
    for (auto& slot : images) slot.resize(cameras.size());
    captures.resize(cameras.size());
    SocketSettings of_sockets{live.address,
                              is_plain,
                              {},
                              {},
                              kMostOverLimit * static_cast<std::int64_t>(limit),
                              static_cast<std::uint32_t>(most_at_once())};
    if (keys) {
      of_sockets.secret_key = keys->server.secret_key;
      of_sockets.clients = keys->clients;
    }
    sockets.emplace(of_sockets);
    address = sockets->address();
    thread = std::thread([this] { listen(); });
  }
  ~Impl() {
    stops = true;
    wake.wake();
    if (thread.joinable()) thread.join();
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void listen();
  int receive_all(bool slowly);
  int most_at_once() const { return 4 * static_cast<int>(gates.size()) + 16; }
  void receive(const std::string& identity, const std::string& user, std::string_view bytes);
  Refusal take_packet(CameraGate& of, std::string_view bytes, PacketHead& head);
  CameraGate* find(const std::string& name);
  void answer(const std::string& identity, const std::string& bytes);
  void greet(const std::string& identity, const std::string& user, const LiveMessage& message);
  void send_triggers(double now_s);
  void release(double now_s, SetAssembler::Until until);
  double next_event_s(double now_s) const;
  LiveStatus status() const;

  LiveSettings settings;
  bool is_plain;
  mutable std::mutex mutex;  ///< over all below but sockets
  std::condition_variable has_set;
  std::vector<CameraGate> gates;
  SetAssembler assembler;
  std::array<std::vector<CameraImages>, SetAssembler::kSlots> images;
  std::vector<double> captures;  ///< per camera, the newest on our clock
  std::optional<SetAssembler::Released> released;
  double released_s = 0;
  std::int64_t unseen = 0, strangers = 0;
  Timings timings;
  PacketCoder coder;
  RateLimit intake;  ///< of messages of all connections
  RateLimit asked{kMostAsked_1_s};
  bool is_flooded = false, has_more = false;
  CameraImages tried;  ///< of a camera that isn't waited for
  std::string failure;

  std::optional<SocketProcess> sockets;
  std::string address;
  WakeUp wake;
  std::atomic<bool> stops = false;
  double next_trigger_s = 0;
  std::int64_t trigger = 0;  ///< twice the tick, plus one for depth cameras
  std::thread thread;        ///< last: it uses the others
};

void RigServer::Impl::listen() try {
  while (!stops) {
    const double wait_s = has_more ? 0 : next_event_s(now_s()) - now_s();
    std::array<pollfd, 2> items{{{sockets->fd(), POLLIN, 0}, {wake.fd(), POLLIN, 0}}};
    const auto wait_ms = static_cast<int>(std::ceil(std::clamp(wait_s, 0.0, kMostSleep_s) * 1e3));
    ::poll(items.data(), items.size(), wait_ms);
    sockets->tend(now_s());
    const int received = receive_all(is_flooded);
    is_flooded = !intake.take(received, now_s());
    if (is_flooded) std::this_thread::sleep_for(kFloodPause);
    send_triggers(now_s());
    const std::lock_guard lock(mutex);
    release(now_s(), SetAssembler::Until::deadline);
  }
} catch (const std::exception& error) {
  const std::lock_guard lock(mutex);
  failure = error.what();
  has_set.notify_all();
}

double RigServer::Impl::next_event_s(double now) const {
  double next_s = now + kMostSleep_s;
  if (settings.sync == LiveSync::software) next_s = std::min(next_s, next_trigger_s);
  const std::lock_guard lock(mutex);
  if (const auto deadline_s = assembler.next_deadline_s()) next_s = std::min(next_s, *deadline_s);
  return next_s;
}

/// Some packets, then deadlines: a client that floods the sockets does not hold the sets up, nor takes a
/// core. @returns how many there were.
int RigServer::Impl::receive_all(bool slowly) {
  const int most = slowly ? static_cast<int>(gates.size()) + 8 : most_at_once();
  int count = 0;
  for (LinkFrame message; count < most && sockets->receive(message); ++count)
    receive(std::string(message.identity), std::string(message.user), message.body);
  sockets->give_credit(static_cast<std::uint32_t>(count));
  has_more = count == most;
  return count;
}

CameraGate* RigServer::Impl::find(const std::string& name) {
  const auto at =
      std::find_if(gates.begin(), gates.end(), [&](const CameraGate& g) { return g.camera().name == name; });
  return at == gates.end() ? nullptr : &*at;
}

void RigServer::Impl::answer(const std::string& identity, const std::string& bytes) {
  sockets->send(identity, bytes);
}

void RigServer::Impl::receive(const std::string& identity, const std::string& user, std::string_view bytes) {
  if (const auto message = parse_live_message(bytes)) return greet(identity, user, *message);
  PacketHead head;
  const Refusal parsed = parse_packet_head(bytes, head);
  std::unique_lock lock(mutex);
  CameraGate* of = find(is_plain ? head.camera : user);
  if (of == nullptr) {
    ++strangers;
    return;
  }
  Refusal refusal = of->check_rate(bytes.size(), now_s());
  if (refusal == Refusal::none) refusal = parsed;
  if (refusal == Refusal::none) refusal = take_packet(*of, bytes, head);
  if (refusal == Refusal::none) of->identity = identity;
  if (refusal == Refusal::repeated && head.copies > 1)
    of->count_copy();
  else if (refusal != Refusal::none && of->count(refusal) == kSecondClientAfter &&
           refusal == Refusal::other_client)
    log_warning("camera '" + of->camera().name +
                "': a second client sends for it, and is refused while the first is heard");
  release(now_s(), SetAssembler::Until::whole);
  lock.unlock();
  answer(identity,
         live_message_bytes({LiveMessage::kReceipt, static_cast<std::uint32_t>(refusal), head.sequence, {}}));
}

/// The images, into the set that they belong to.
Refusal RigServer::Impl::take_packet(CameraGate& of, std::string_view bytes, PacketHead& head) {
  if (find(head.camera) == nullptr) return Refusal::no_such_camera;
  if (head.camera != of.camera().name) return Refusal::other_camera;
  if (bytes.size() > packet_limit(of.camera().size_px)) return Refusal::too_long;
  const double now = now_s();
  const auto camera = static_cast<std::size_t>(&of - gates.data());
  double captured_s = 0;
  if (const Refusal refusal = of.check(head, now, captured_s); refusal != Refusal::none) return refusal;
  if (assembler.options().by_trigger && head.trigger == PacketHead::kNoTrigger) return Refusal::head;
  const SetAssembler::Place place =
      assembler.admit({static_cast<int>(camera), head.trigger, captured_s, now});
  if (place.refusal == Refusal::late && assembler.is_doubted(place.camera)) {
    // The set went without it. Is it well again?
    const bool was_in_time = now - captured_s <= assembler.options().deadline_s;
    if (was_in_time && coder.unpack(bytes, head, tried)) assembler.trust(place.camera);
  }
  if (place.refusal != Refusal::none) return place.refusal;
  CameraImages& room = images[static_cast<std::size_t>(place.slot)][camera];
  if (!coder.unpack(bytes, head, room)) return Refusal::payload;
  assembler.fill(place);
  captures[camera] = captured_s;
  of.taken(room, captured_s, assembler.captured_s(place.slot));
  return Refusal::none;
}

void RigServer::Impl::greet(const std::string& identity, const std::string& user,
                            const LiveMessage& message) {
  const std::unique_lock lock(mutex);
  if (message.kind == LiveMessage::kAsk && (is_plain || user == kStatusName)) {
    if (asked.take(1, now_s())) answer(identity, live_status_json(status()));
    return;
  }
  CameraGate* of = find(is_plain ? message.camera : user);
  if (of != nullptr && !of->take_small_message(now_s())) return;
  if (message.kind == LiveMessage::kHello && of != nullptr && message.camera == of->camera().name) {
    if (of->is_client(message.number, now_s())) of->identity = identity;
  } else {
    ++strangers;
  }
}

/// Optical cameras at the beginning of a period, depth cameras in its middle: their light would disturb the
/// others.
void RigServer::Impl::send_triggers(double now) {
  if (settings.sync != LiveSync::software) return;
  const double half_s = 0.5 / settings.fps;
  if (next_trigger_s == 0 || now - next_trigger_s > 1) next_trigger_s = now;
  while (next_trigger_s <= now) {
    LiveMessage message{LiveMessage::kTrigger,
                        static_cast<std::uint32_t>(trigger % 2),
                        static_cast<std::uint64_t>(trigger / 2),
                        {}};
    for (const CameraGate& g : gates) {
      if (g.identity.empty() || g.camera().is_depth != (trigger % 2 == 1)) continue;
      answer(g.identity, live_message_bytes(message));
    }
    ++trigger;
    next_trigger_s += half_s;
  }
}

void RigServer::Impl::release(double now, SetAssembler::Until until) {
  bool any = false;
  while (const auto set = assembler.release(now, until)) {
    if (released) {
      assembler.recycle(released->slot);
      ++unseen;
    }
    released = set;
    released_s = now;
    timings.add("release", set->captured_s, now);
    any = true;
  }
  if (any) has_set.notify_one();
}

LiveStatus RigServer::Impl::status() const {
  const double now = now_s();
  LiveStatus s;
  for (std::size_t c = 0; c < gates.size(); ++c) {
    s.cameras.push_back(gates[c].status(now));
    s.cameras.back().is_present = assembler.is_present(static_cast<int>(c), now);
  }
  s.sets = assembler.counts().released;
  s.complete_sets = assembler.counts().complete;
  s.unseen_sets = unseen;
  s.refused_keys = sockets->refused_keys();
  s.socket_restarts = sockets->restarts();
  s.refused_strangers = strangers;
  s.release_ms_p50 = timings.percentile_ms("release", 50);
  s.release_ms_p99 = timings.percentile_ms("release", 99);
  return s;
}

RigServer::RigServer(const std::vector<LiveCamera>& cameras, const LiveSettings& settings,
                     const std::optional<Keys>& keys)
    : impl_(std::make_unique<Impl>(cameras, settings, keys)) {}
RigServer::~RigServer() = default;

std::string RigServer::address() const { return impl_->address; }

bool RigServer::wait(LiveSet& set, double until_s) {
  Impl& m = *impl_;
  std::unique_lock lock(m.mutex);
  const std::chrono::duration<double> most(std::max(until_s - now_s(), 0.0));
  m.has_set.wait_for(lock, most, [&] { return m.released.has_value() || !m.failure.empty(); });
  if (!m.failure.empty()) throw Error("the server of live cameras ended: " + m.failure);
  if (!m.released) return false;
  const auto slot = static_cast<std::size_t>(m.released->slot);
  set.tick = m.released->tick;
  set.captured_s = m.released->captured_s;
  set.released_s = m.released_s;
  set.is_complete = m.released->is_complete;
  set.images.resize(m.gates.size());
  set.is_in.resize(m.gates.size());
  for (std::size_t c = 0; c < set.images.size(); ++c) {
    set.is_in[c] = m.assembler.has(m.released->slot, static_cast<int>(c));
    std::swap(set.images[c], m.images[slot][c]);
  }
  m.assembler.recycle(m.released->slot);
  m.released.reset();
  return true;
}

std::int64_t RigServer::socket_restarts() const { return impl_->sockets->restarts(); }

LiveStatus RigServer::status() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->status();
}

}  // namespace tactus
