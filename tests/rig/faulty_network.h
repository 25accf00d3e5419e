#pragma once
/// A network between clients and a server, in this process, that drops, delays, doubles and reorders packets.
#include <zmq.h>

#include <array>
#include <atomic>
#include <map>
#include <random>
#include <string>
#include <thread>
#include <vector>

namespace tactus::test {

/// Shares of the packets, 0..1. What comes back (receipts) is only delayed by jitter.
struct NetworkFaults {
  double drop = 0, late = 0, late_s = 0.020;
  double twice = 0;      ///< once more, 5 ms later
  double overtaken = 0;  ///< delayed by `overtaken_s`, so that the next comes before it
  double overtaken_s = 0.045;
  double jitter_s = 0;  ///< up to so much, each
};

/// Listens on a port of its own of this computer for clients without keys, and has a connection to the server
/// for each. A thread hands messages on when they are due. At most kMostWaiting wait, the others are dropped.
class FaultyNetwork {
 public:
  static constexpr std::size_t kMostWaiting = 256, kMostClients = 32;
  FaultyNetwork(const std::string& server, const NetworkFaults& faults);
  ~FaultyNetwork();
  FaultyNetwork(const FaultyNetwork&) = delete;
  FaultyNetwork& operator=(const FaultyNetwork&) = delete;

  const std::string& address() const { return address_; }
  struct Counts {
    std::atomic<long> packets = 0, dropped = 0, late = 0, twice = 0, overtaken = 0, crowded = 0;
  };
  const Counts& counts() const { return counts_; }

 private:
  struct Client {
    std::string identity;
    void* to_server;
  };
  struct Waiting {
    std::size_t client;
    bool is_up;  ///< to the server
    std::string bytes;
  };
  void work();
  std::size_t client_of(const std::string& identity);
  void take_up(std::size_t client, std::string bytes, double now_s);
  void add(double due_s, std::size_t client, bool is_up, std::string bytes);
  void hand_on(double now_s);
  double chance() { return std::uniform_real_distribution<double>(0, 1)(random_); }

  std::string server_, address_;
  NetworkFaults faults_;
  std::mt19937 random_{7};
  void *context_, *front_;
  std::vector<Client> clients_;
  std::multimap<double, Waiting> waiting_;
  Counts counts_;
  std::atomic<bool> stops_ = false;
  std::thread thread_;  ///< last: it uses the others
};

}  // namespace tactus::test
