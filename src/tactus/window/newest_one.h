#pragma once
/// A place for one thing, between two threads.
#include <mutex>
#include <utility>

namespace tactus {

/// The newest replaces one that nobody took.
template <class T>
class NewestOne {
 public:
  void put(T thing) {
    const std::lock_guard lock(mutex_);
    thing_ = std::move(thing);
  }
  /// An empty T where nothing came since the last call.
  T take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(thing_, T{});
  }
  bool is_empty() const {
    const std::lock_guard lock(mutex_);
    return !thing_;
  }

 private:
  mutable std::mutex mutex_;
  T thing_{};
};

}  // namespace tactus
