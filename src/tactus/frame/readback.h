#pragma once
/// Records of a frame that the host reads: one copy per device, into pinned memory.
#include <cstring>
#include <type_traits>

#include "tactus/frame/readback_kernels.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {

/// Before the first frame, add() all records to be read. In a frame, submit() after the kernels that write
/// them. Once the devices were waited for, get().
class Readback {
 public:
  explicit Readback(DeviceSet& devices)
      : devices_(devices), parts_(static_cast<std::size_t>(devices.count())) {}

  /// Where a record lies among those of its device.
  struct Place {
    std::size_t part = 0;
    Index first_word = 0, count = 0;
  };
  template <class T>
  Place add(View<const T> records, int part = 0) {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(std::uint32_t) == 0);
    return add_words(reinterpret_cast<const std::uint32_t*>(records.data()),
                     static_cast<Index>(sizeof(T) / sizeof(std::uint32_t)) * records.size(), records.size(),
                     part);
  }
  /// All records are added anew. Nothing may be on the way.
  void clear() { parts_ = std::vector<Part>(parts_.size()); }
  /// Asynchronous; may be recorded, once all was added.
  void submit();
  /// As the device had them at submit().
  template <class T>
  std::vector<T> get(const Place& place) const {
    std::vector<T> records(static_cast<std::size_t>(place.count));
    if (!records.empty())
      std::memcpy(static_cast<void*>(records.data()), words(place), sizeof(T) * records.size());
    return records;
  }

 private:
  struct Part {
    std::vector<ReadbackItem> items;
    Index words = 0;
    Buffer<ReadbackItem> items_on_device;
    Buffer<Index> item_of_word;
    Buffer<std::uint32_t> gathered;
    HostBuffer<std::uint32_t> read;
  };
  Place add_words(const std::uint32_t* from, Index words, Index count, int part);
  void allocate(ExecContext& ctx, Part& part);
  const std::uint32_t* words(const Place& place) const;

  DeviceSet& devices_;
  std::vector<Part> parts_;
};

}  // namespace tactus
