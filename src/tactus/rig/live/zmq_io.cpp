#include "tactus/rig/live/zmq_io.h"

#include <array>

#include "tactus/base/error.h"

namespace tactus {

void throw_zmq(const std::string& what) { throw Error(what + ": " + zmq_strerror(zmq_errno())); }

ZmqContext::ZmqContext() : context_(zmq_ctx_new()) {
  if (context_ == nullptr) throw_zmq("ZeroMQ can't start");
}
ZmqContext::~ZmqContext() { zmq_ctx_term(context_); }

ZmqSocket::ZmqSocket(const ZmqContext& context, int type) : socket_(zmq_socket(context.get(), type)) {
  if (socket_ == nullptr) throw_zmq("ZeroMQ gives no socket");
  set(ZMQ_LINGER, 0);
}
ZmqSocket::~ZmqSocket() { zmq_close(socket_); }

void ZmqSocket::set(int option, int value) {
  if (zmq_setsockopt(socket_, option, &value, sizeof value) != 0) throw_zmq("ZeroMQ refuses an option");
}
void ZmqSocket::set(int option, std::int64_t value) {
  if (zmq_setsockopt(socket_, option, &value, sizeof value) != 0) throw_zmq("ZeroMQ refuses an option");
}
void ZmqSocket::set(int option, const std::string& text) {
  if (zmq_setsockopt(socket_, option, text.c_str(), text.size()) != 0)
    throw_zmq("ZeroMQ refuses an option or key");
}
void ZmqSocket::bind(const std::string& address) {
  if (zmq_bind(socket_, address.c_str()) != 0) throw_zmq("can't listen on '" + address + "'");
}
void ZmqSocket::connect(const std::string& address) {
  if (zmq_connect(socket_, address.c_str()) != 0) throw_zmq("can't connect to '" + address + "'");
}

void ZmqSocket::disconnect(const std::string& address) { zmq_disconnect(socket_, address.c_str()); }

std::string ZmqSocket::endpoint() const {
  std::array<char, 256> text{};
  std::size_t size = text.size();
  if (zmq_getsockopt(socket_, ZMQ_LAST_ENDPOINT, text.data(), &size) != 0)
    throw_zmq("ZeroMQ has no endpoint");
  return text.data();
}

bool ZmqSocket::send(std::string_view bytes, bool more) {
  return zmq_send(socket_, bytes.data(), bytes.size(), ZMQ_DONTWAIT | (more ? ZMQ_SNDMORE : 0)) >= 0;
}

void drop_dead_connections(ZmqSocket& socket) {
  constexpr int kOn = 1, kIdle_s = 1, kInterval_s = 1, kAnswers = 3, kUnanswered_ms = 4000;
  socket.set(ZMQ_TCP_KEEPALIVE, kOn);
  socket.set(ZMQ_TCP_KEEPALIVE_IDLE, kIdle_s);
  socket.set(ZMQ_TCP_KEEPALIVE_INTVL, kInterval_s);
  socket.set(ZMQ_TCP_KEEPALIVE_CNT, kAnswers);
  socket.set(ZMQ_TCP_MAXRT, kUnanswered_ms);
}

}  // namespace tactus
