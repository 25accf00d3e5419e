#include "tactus/rig/live/zmq_io.h"

#include <sys/eventfd.h>
#include <unistd.h>

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

WakeUp::WakeUp() : fd_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  if (fd_ < 0) throw Error("the system gives no event descriptor");
}
WakeUp::~WakeUp() { ::close(fd_); }
void WakeUp::wake() const {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t n = ::write(fd_, &one, sizeof one);
}
void WakeUp::clear() const {
  std::uint64_t count = 0;
  [[maybe_unused]] const ssize_t n = ::read(fd_, &count, sizeof count);
}

}  // namespace tactus
