#pragma once
/// Work on all devices of a set that is recorded once and replayed as one graph.
#include <functional>
#include <optional>

#include "tactus/multi_device/device_set.h"

namespace tactus {

/// A recording of the work submitted to the contexts of a set (GPUs only). Work submitted to other contexts
/// meanwhile must wait for these contexts, and they for it.
class DeviceGraph {
 public:
  void record(DeviceSet& devices, const std::function<void()>& work);
  bool is_recorded() const { return graph_.has_value(); }
  /// All contexts wait for one another before it and after it.
  void launch(DeviceSet& devices);
  /// On a stream of the first device that waits for all that the work needs, and for which others wait.
  void launch_on(ExecContext& ctx);

 private:
  std::optional<Graph> graph_;
  Event fork_, done_;
  std::vector<Event> join_, ready_;  ///< per context but the first; events of a recording stay in it
};

/// A stage that is recorded on its second run and replayed from then on (GPUs only; others just run). Within
/// another recording it just runs.
class DeviceReplay {
 public:
  void run(DeviceSet& devices, const std::function<void()>& stage);

 private:
  int runs_ = 0;
  DeviceGraph graph_;
};

/// Whether kernels of a context of the set are timed one by one, which a recording can't do.
bool is_profiling(DeviceSet& devices);

}  // namespace tactus
