#pragma once
/// Which images belong to one tick, and when their set is released.
#include <cstdint>
#include <optional>
#include <vector>

#include "tactus/rig/wire/packet.h"

namespace tactus {

/// Puts images of cameras together to sets. Knows no images, only their places: its owner keeps room for
/// kSlots images of every camera.
///
///   place = a.admit(arrival)        where to unpack the images, or why they are refused
///   a.fill(place)                   they are there (or not: don't call it)
///   while (set = a.release(now))    oldest first: complete, or at its deadline, incomplete
///   a.recycle(set.slot)             its images were taken
///
/// A caller that was held up finds packets that came in time and a deadline that is over. So while packets
/// wait, sets are released when they are whole (Until::whole); deadlines come after them.
///
/// A tick is the number of the trigger, or where cameras don't count triggers, the beat of the rig's period
/// that is nearest to the capture. The beat's phase follows the captures. A camera stays on its beats:
/// between two of its images lie as many ticks as periods, so one whose phase is half a period off doesn't
/// alternate. A camera moves the phase by the same part a period, however many packets it sends.
///
/// A camera that was not heard of for absent_s is not waited for, nor one that missed kFailures sets in a row
/// although it was heard: from then on `trust` says that it delivers again. Numbers of triggers that are far
/// from the newest set are refused, unless more than half of the cameras that are heard say so: then counting
/// began anew. So are numbers before their time, where triggers are steady and more than half of the cameras
/// say so. So no camera alone can make the others late.
///
/// All times are on one clock. Memory is fixed. Nothing depends on anything but the calls.
class SetAssembler {
 public:
  static constexpr int kOpen = 8;  ///< most sets that are waited for
  static constexpr int kFailures = 3;
  static constexpr int kSlots = kOpen + 2;  ///< one that is released and waits, and one that is looked at
  struct Options {
    int cameras = 0;
    double period_s = 1.0 / 30;
    double deadline_s = 0.033;  ///< from the capture to the release
    double absent_s = 0.5;
    bool by_trigger = false;
  };
  struct Arrival {
    int camera = 0;
    std::int64_t trigger = 0;
    double captured_s = 0, arrived_s = 0;
  };
  struct Place {
    Refusal refusal = Refusal::none;
    int camera = 0, slot = -1;
  };
  struct Released {
    std::int64_t tick = 0;
    double captured_s = 0;
    int slot = -1;
    bool is_complete = false;  ///< all cameras of the rig are in it
  };
  struct Counts {
    std::int64_t released = 0, complete = 0;
  };
  enum class Until : std::uint8_t { whole, deadline };

  explicit SetAssembler(const Options& options);

  Place admit(const Arrival& arrival);
  void fill(const Place& place);
  /// @param until the event that ends a set's wait: its last image, or its deadline, too
  std::optional<Released> release(double now_s, Until until = Until::deadline);
  void recycle(int slot) { slots_[static_cast<std::size_t>(slot)].state = State::free; }
  /// Whether the set in a slot has images of a camera.
  bool has(int slot, int camera) const {
    return slots_[static_cast<std::size_t>(slot)].is_in[static_cast<std::size_t>(camera)];
  }
  /// Capture time of the first images of the set in a slot.
  double captured_s(int slot) const { return slots_[static_cast<std::size_t>(slot)].captured_s; }
  /// When release may have something without another arrival; none: not before one.
  std::optional<double> next_deadline_s() const;
  bool is_present(int camera, double now_s) const;
  /// Whether a camera missed so many sets that it isn't waited for.
  bool is_doubted(int camera) const { return heard_[static_cast<std::size_t>(camera)].failures >= kFailures; }
  /// Its images were good and came before their deadline, if after the set, which didn't wait for them.
  void trust(int camera) { heard_[static_cast<std::size_t>(camera)].failures = 0; }
  const Counts& counts() const { return counts_; }
  const Options& options() const { return options_; }

 private:
  enum class State : std::uint8_t { free, open, released };
  struct Slot {
    State state = State::free;
    std::int64_t tick = 0;
    double captured_s = 0, deadline_s = 0;
    std::vector<bool> is_reserved, is_in;
    int in = 0;
  };
  struct Heard {
    bool ever = false;
    std::int64_t tick = 0;  ///< that it said last
    double captured_s = 0, arrived_s = 0;
    double step_s = 0;  ///< from one trigger to the next
    int steady = 0;     ///< steps in a row that were like the one before
    int failures = 0;   ///< sets in a row that it missed
  };
  std::int64_t tick_of(const Arrival& arrival);
  std::int64_t nearest_beat(double captured_s) const;
  double beat_s(std::int64_t tick) const;
  void hear(const Arrival& arrival, std::int64_t tick);
  bool is_ahead(const Arrival& arrival, std::int64_t tick) const;
  bool most_agree(const Arrival& arrival, std::int64_t tick) const;
  Slot* open_slot(std::int64_t tick);
  Slot* oldest();
  const Slot* oldest() const;

  Options options_;
  std::vector<Slot> slots_;
  std::vector<Heard> heard_;
  std::int64_t newest_ = 0, released_ = 0;  ///< ticks; valid when is_anchored_
  bool is_anchored_ = false, has_phase_ = false;
  double phase_s_ = 0;
  Counts counts_;
};

}  // namespace tactus
