#pragma once
/// TCP over a way that loses segments, in this process.
#include <array>
#include <atomic>
#include <deque>
#include <list>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace tactus::test {

struct LinkFaults {
  double way_s = 0.020, jitter_s = 0.005;  ///< one way: way +- jitter
  double lost = 0.02;                      ///< share of the segments that have to be sent again
  double again_s = 0.200;                  ///< which takes so long (Linux' shortest retransmission timeout)
};

/// Listens on a port of its own and hands bytes on to a server, in segments of at most 1448 bytes. As TCP
/// does, it keeps their order: what follows a lost segment waits for it, but other connections don't.
class LossyLink {
 public:
  LossyLink(const std::string& server, const LinkFaults& faults);
  ~LossyLink();
  LossyLink(const LossyLink&) = delete;
  LossyLink& operator=(const LossyLink&) = delete;

  /// tcp://127.0.0.1:PORT
  const std::string& address() const { return address_; }
  /// All connections of now stay open, and nothing passes any more: a computer on the way forgot them.
  void forget_connections() { forgets_ = true; }
  long segments() const { return segments_; }
  long lost() const { return lost_; }

 private:
  struct Segment {
    double due_s;
    std::string bytes;
  };
  /// One direction of a connection.
  struct Lane {
    int from, to;
    double last_due_s = 0;
    std::deque<Segment> segments = {};
  };
  struct Connection {
    std::array<Lane, 2> lanes;
    bool is_open = true, is_forgotten = false;
  };
  void work();
  void accept_one();
  void take(Connection& connection, Lane& lane, double now_s);
  void hand_on(Connection& connection, Lane& lane, double now_s);
  double chance() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  LinkFaults faults_;
  int server_port_ = 0, listener_ = -1;
  std::string address_;
  std::mt19937 random_{7};
  std::list<Connection> connections_;
  std::atomic<long> segments_ = 0, lost_ = 0;
  std::atomic<bool> stops_ = false, forgets_ = false;
  std::thread thread_;  ///< last: it uses the others
};

}  // namespace tactus::test
