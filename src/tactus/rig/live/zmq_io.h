#pragma once
/// ZeroMQ's handles with an owner. Only files of this folder include it.
#include <zmq.h>

#include <cstdint>
#include <string>
#include <string_view>

namespace tactus {

/// @throws Error "TEXT: REASON": the given text, and the reason of ZeroMQ's last error.
[[noreturn]] void throw_zmq(const std::string& what);

class ZmqContext {
 public:
  ZmqContext();
  ~ZmqContext();
  ZmqContext(const ZmqContext&) = delete;
  ZmqContext& operator=(const ZmqContext&) = delete;
  void* get() const { return context_; }

 private:
  void* context_;
};

/// Closed at once: messages that were not sent yet are dropped. One thread uses it.
class ZmqSocket {
 public:
  ZmqSocket(const ZmqContext& context, int type);
  ~ZmqSocket();
  ZmqSocket(const ZmqSocket&) = delete;
  ZmqSocket& operator=(const ZmqSocket&) = delete;
  void* get() const { return socket_; }
  void set(int option, int value);
  void set(int option, std::int64_t value);
  void set(int option, const std::string& text);
  void bind(const std::string& address);
  void connect(const std::string& address);
  /// Forgets the connection there.
  void disconnect(const std::string& address);
  /// Address of the last bind, with the port that a wildcard became.
  std::string endpoint() const;
  /// Never waits. @returns false where it can't be sent now.
  bool send(std::string_view bytes, bool more = false);

 private:
  void* socket_;
};

/// The system asks connections that say nothing whether their computer is there, and drops those that don't
/// answer, or take nothing, for some seconds. (ZeroMQ's own heartbeats don't: in 4.3.4 their timer calls
/// abort() on a connection that broke while its messages were not read.)
void drop_dead_connections(ZmqSocket& socket);

class ZmqMessage {
 public:
  ZmqMessage() { zmq_msg_init(&message_); }
  ~ZmqMessage() { zmq_msg_close(&message_); }
  ZmqMessage(const ZmqMessage&) = delete;
  ZmqMessage& operator=(const ZmqMessage&) = delete;
  /// Never waits. @returns false when nothing is there.
  bool receive(const ZmqSocket& from) { return zmq_msg_recv(&message_, from.get(), ZMQ_DONTWAIT) >= 0; }
  std::string_view bytes() const {
    return {static_cast<const char*>(zmq_msg_data(&message_)), zmq_msg_size(&message_)};
  }
  bool more() const { return zmq_msg_more(&message_) != 0; }
  /// The sender's name, as ZAP gave it; "" in plain mode.
  std::string user() const {
    const char* name = zmq_msg_gets(&message_, "User-Id");
    return name == nullptr ? std::string() : name;
  }

 private:
  mutable zmq_msg_t message_;
};

}  // namespace tactus
