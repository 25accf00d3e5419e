#pragma once
/// Runs the deferred queues of virtual devices in a random order that their events allow. Code that works
/// only because of lucky timing breaks here, reproducibly for a seed.
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace tactus {

class VirtualScheduler {
 public:
  /// `seed` 0: a fixed, fair order (queue after queue); others: random legal orders.
  explicit VirtualScheduler(std::uint64_t seed) : shuffle_(seed != 0), random_(seed) {}

  /// A flag that a record sets and a wait needs.
  struct Flag {
    std::uint64_t recorded = 0;  ///< number of records submitted
    std::uint64_t reached = 0;   ///< number of records run
  };

  int add_queue();
  void submit(int queue, std::string name, std::function<void()> work);
  void record(int queue, const std::shared_ptr<Flag>& flag);
  void wait(int queue, const std::shared_ptr<Flag>& flag);
  /// Runs until `queue` is empty; others advance at random on the way. @throws Error on a wait nobody
  /// fulfils.
  void drain(int queue);

 private:
  struct Op {
    std::string name;
    std::function<void()> work;
    std::shared_ptr<Flag> waits_for;  ///< ready when reached >= target
    std::uint64_t target = 0;
  };
  bool ready(const std::deque<Op>& queue) const;
  void run_head(std::size_t queue);

  bool shuffle_;
  std::mt19937_64 random_;
  std::vector<std::deque<Op>> queues_;
};

}  // namespace tactus
