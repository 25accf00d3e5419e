#pragma once
/// Host memory from which all devices of a set copy, while the host already fills the next upload.
#include <algorithm>
#include <array>
#include <vector>

#include "tactus/multi_device/device_set.h"

namespace tactus {

/// Per upload: fill `next()`, submit the copies to the set's contexts, then call `sent()`.
template <class T>
class UploadRing {
 public:
  UploadRing() = default;
  UploadRing(DeviceSet& devices, std::int64_t count) : devices_(&devices) {
    for (Slot& slot : slots_) {
      slot.values = HostBuffer<T>(devices.device(0), count);
      std::fill_n(slot.values.data(), count, T{});
      slot.sent.resize(static_cast<std::size_t>(devices.count()));
    }
  }

  /// A slot that no copy reads any more. Waits for the copies of three uploads ago, which are usually done.
  std::span<T> next() {
    newest_ = (newest_ + 1) % slots_.size();
    Slot& slot = slots_[newest_];
    devices_->for_each_part([&](ExecContext& ctx, int p) { ctx.synchronize(slot.sent[at(p)]); });
    return slot.values.span();
  }
  /// The slot that `next` returned last.
  std::span<const T> newest() const { return slots_[newest_].values.span(); }
  void sent() {
    devices_->for_each_part([&](ExecContext& ctx, int p) { ctx.record(slots_[newest_].sent[at(p)]); });
  }

 private:
  static std::size_t at(int part) { return static_cast<std::size_t>(part); }
  struct Slot {
    HostBuffer<T> values;
    std::vector<Event> sent;  ///< per device
  };
  DeviceSet* devices_ = nullptr;
  std::array<Slot, 3> slots_;
  std::size_t newest_ = 0;
};

}  // namespace tactus
