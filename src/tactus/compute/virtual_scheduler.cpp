#include "tactus/compute/virtual_scheduler.h"

#include "tactus/base/error.h"

namespace tactus {

int VirtualScheduler::add_queue() {
  queues_.emplace_back();
  return static_cast<int>(queues_.size()) - 1;
}

void VirtualScheduler::submit(int queue, std::string name, std::function<void()> work) {
  queues_[static_cast<std::size_t>(queue)].push_back({std::move(name), std::move(work), nullptr, 0});
}

void VirtualScheduler::record(int queue, const std::shared_ptr<Flag>& flag) {
  const std::uint64_t number = ++flag->recorded;
  submit(queue, "record", [flag, number] { flag->reached = number; });
}

void VirtualScheduler::wait(int queue, const std::shared_ptr<Flag>& flag) {
  queues_[static_cast<std::size_t>(queue)].push_back({"wait", [] {}, flag, flag->recorded});
}

bool VirtualScheduler::ready(const std::deque<Op>& queue) const {
  return !queue.empty() &&
         (queue.front().waits_for == nullptr || queue.front().waits_for->reached >= queue.front().target);
}

void VirtualScheduler::run_head(std::size_t queue) {
  const Op op = std::move(queues_[queue].front());
  queues_[queue].pop_front();
  op.work();
}

void VirtualScheduler::drain(int queue) {
  const auto wanted = static_cast<std::size_t>(queue);
  while (!queues_[wanted].empty()) {
    std::vector<std::size_t> runnable;
    for (std::size_t q = 0; q < queues_.size(); ++q) {
      if (ready(queues_[q])) runnable.push_back(q);
    }
    if (runnable.empty()) {
      throw Error("virtual devices: queue " + std::to_string(queue) + " waits at '" +
                  queues_[wanted].front().name + "' for an event that nothing records");
    }
    run_head(shuffle_ ? runnable[random_() % runnable.size()] : runnable.front());
  }
}

}  // namespace tactus
