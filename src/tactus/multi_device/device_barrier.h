#pragma once
/// All devices wait for one another.
#include "tactus/multi_device/device_set.h"

namespace tactus {

/// A barrier of the first `count` devices of a set. Asynchronous; may be recorded, since it waits for nothing
/// older.
class DeviceBarrier {
 public:
  DeviceBarrier(DeviceSet& devices, int count) : devices_(devices), came_(static_cast<std::size_t>(count)) {}

  /// Work submitted to these devices from now on runs after all work submitted to any of them so far.
  void meet() {
    const int count = static_cast<int>(came_.size());
    if (count == 1) return;
    for (int p = 0; p < count; ++p) devices_.context(p).record(event(p));
    for (int p = 0; p < count; ++p) {
      for (int other = 0; other < count; ++other)
        if (other != p) devices_.context(p).wait(event(other));
    }
  }

 private:
  Event& event(int part) { return came_[static_cast<std::size_t>(part)]; }
  DeviceSet& devices_;
  std::vector<Event> came_;  ///< per device
};

}  // namespace tactus
