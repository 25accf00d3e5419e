#pragma once
/// Work on all devices of a set that is recorded once and replayed as one graph.
#include <functional>
#include <optional>

#include "tactus/multi_device/device_set.h"

namespace tactus {

/// A stage that is recorded on its second run and replayed from then on (GPUs only; others just run). What
/// the stage submits to contexts that are not the set's must wait for those, and be waited for.
class DeviceReplay {
 public:
  void run(DeviceSet& devices, const std::function<void()>& stage);

 private:
  int runs_ = 0;
  std::optional<Graph> graph_;
  Event fork_, done_;
  std::vector<Event> join_, ready_;  ///< per context but the first; events of a recording stay in it
};

}  // namespace tactus
