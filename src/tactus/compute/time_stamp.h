#pragma once
/// Points in time on a device's stream, also inside recordings.
#include <memory>

#include "tactus/compute/exec_context.h"

namespace tactus {

/// When a device came to a point of its stream. Take it again in every frame.
class TimeStamp {
 public:
  TimeStamp();
  ~TimeStamp();
  TimeStamp(TimeStamp&&) noexcept;
  TimeStamp& operator=(TimeStamp&&) noexcept;

  /// Asynchronous; may be recorded.
  void take(ExecContext& ctx);
  /// From an earlier stamp of the same device to this one [s]; 0 when one of them was not taken. Synchronize
  /// the context first.
  double seconds_since(const TimeStamp& earlier) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tactus
