#include "rig/faulty_network.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "tactus/base/timing.h"

namespace tactus::test {
namespace {

constexpr std::size_t kSmall = 56;  // bytes of the messages that are no packets
constexpr double kTwice_s = 0.005;

void expect(bool ok, const char* what) {
  if (!ok) throw std::runtime_error(std::string(what) + ": " + zmq_strerror(zmq_errno()));
}

void* make_socket(void* context, int type) {
  void* socket = zmq_socket(context, type);
  expect(socket != nullptr, "no socket");
  const int none = 0, most = 64;
  zmq_setsockopt(socket, ZMQ_LINGER, &none, sizeof none);
  zmq_setsockopt(socket, ZMQ_SNDHWM, &most, sizeof most);
  zmq_setsockopt(socket, ZMQ_RCVHWM, &most, sizeof most);
  return socket;
}

std::optional<std::string> receive(void* socket) {
  zmq_msg_t message;
  zmq_msg_init(&message);
  std::optional<std::string> bytes;
  if (zmq_msg_recv(&message, socket, ZMQ_DONTWAIT) >= 0)
    bytes.emplace(static_cast<const char*>(zmq_msg_data(&message)), zmq_msg_size(&message));
  zmq_msg_close(&message);
  return bytes;
}

}  // namespace

FaultyNetwork::FaultyNetwork(const std::string& server, const NetworkFaults& faults)
    : server_(server), faults_(faults), context_(zmq_ctx_new()), front_(make_socket(context_, ZMQ_ROUTER)) {
  expect(zmq_bind(front_, "tcp://127.0.0.1:*") == 0, "no port");
  std::array<char, 64> endpoint{};
  std::size_t size = endpoint.size();
  expect(zmq_getsockopt(front_, ZMQ_LAST_ENDPOINT, endpoint.data(), &size) == 0, "no address");
  address_ = endpoint.data();
  thread_ = std::thread([this] { work(); });
}

FaultyNetwork::~FaultyNetwork() {
  stops_ = true;
  thread_.join();
  for (const Client& client : clients_) zmq_close(client.to_server);
  zmq_close(front_);
  zmq_ctx_term(context_);
}

std::size_t FaultyNetwork::client_of(const std::string& identity) {
  const auto at =
      std::find_if(clients_.begin(), clients_.end(), [&](const Client& c) { return c.identity == identity; });
  if (at != clients_.end()) return static_cast<std::size_t>(at - clients_.begin());
  if (clients_.size() == kMostClients) return kMostClients;
  clients_.push_back({identity, make_socket(context_, ZMQ_DEALER)});
  zmq_connect(clients_.back().to_server, server_.c_str());
  return clients_.size() - 1;
}

void FaultyNetwork::add(double due_s, std::size_t client, bool is_up, std::string bytes) {
  if (waiting_.size() == kMostWaiting) {
    ++counts_.crowded;
    return;
  }
  waiting_.emplace(due_s, Waiting{client, is_up, std::move(bytes)});
}

void FaultyNetwork::take_up(std::size_t client, std::string bytes, double now_s) {
  double due_s = now_s + faults_.jitter_s * chance();
  if (bytes.size() > kSmall) {
    ++counts_.packets;
    if (chance() < faults_.drop) {
      ++counts_.dropped;
      return;
    }
    if (chance() < faults_.twice) {
      ++counts_.twice;
      add(due_s + kTwice_s, client, true, bytes);
    }
    if (chance() < faults_.late) {
      ++counts_.late;
      due_s += faults_.late_s;
    }
    if (chance() < faults_.overtaken) {
      ++counts_.overtaken;
      due_s += faults_.overtaken_s;
    }
  }
  add(due_s, client, true, std::move(bytes));
}

void FaultyNetwork::hand_on(double now_s) {
  while (!waiting_.empty() && waiting_.begin()->first <= now_s) {
    const Waiting& w = waiting_.begin()->second;
    const Client& client = clients_[w.client];
    if (!w.is_up)
      zmq_send(front_, client.identity.data(), client.identity.size(), ZMQ_DONTWAIT | ZMQ_SNDMORE);
    zmq_send(w.is_up ? client.to_server : front_, w.bytes.data(), w.bytes.size(), ZMQ_DONTWAIT);
    waiting_.erase(waiting_.begin());
  }
}

void FaultyNetwork::work() {
  std::vector<zmq_pollitem_t> items;
  while (!stops_) {
    items.assign(1, {front_, 0, ZMQ_POLLIN, 0});
    for (const Client& client : clients_) items.push_back({client.to_server, 0, ZMQ_POLLIN, 0});
    const double wait_s = waiting_.empty() ? 0.05 : std::clamp(waiting_.begin()->first - now_s(), 0.0, 0.05);
    zmq_poll(items.data(), static_cast<int>(items.size()), static_cast<long>(std::ceil(1e3 * wait_s)));
    while (const auto identity = receive(front_)) {
      auto bytes = receive(front_);
      const std::size_t client = client_of(*identity);
      if (bytes && client < kMostClients) take_up(client, std::move(*bytes), now_s());
    }
    for (std::size_t c = 0; c < clients_.size(); ++c) {
      while (auto bytes = receive(clients_[c].to_server))
        add(now_s() + faults_.jitter_s * chance(), c, false, std::move(*bytes));
    }
    hand_on(now_s());
  }
}

}  // namespace tactus::test
