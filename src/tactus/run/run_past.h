#pragma once
/// The past of a run: frames that were seen, and the states after them.
#include <algorithm>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tactus/run/frame_loop.h"

namespace tactus {

/// All that the coming frames depend on, and how far the source had come.
struct PastState {
  std::string bytes;  ///< World::save_state
  RunProgress progress;
  int number = 0;  ///< of the frame after which it was saved
};

/// Goes on from there, with the same bits: takes the frames so far again from a source that gave none, and
/// the state over in a world without a past. @param named before messages: the scene's file
RunProgress take_up(const PastState& from, FrameSource& source, World& world, const std::string& named);

/// Saves states in a tenth of the time at most: where that takes long, not every frame has one. One thread
/// saves; any may ask why_not().
class StateSaver {
 public:
  /// @param why_not the reason why none is saved; "": it does
  explicit StateSaver(std::string why_not) : why_not_(std::move(why_not)) {}
  /// @param at_once even if it took long a moment ago @returns nullptr: not now, or this run can't.
  std::shared_ptr<const PastState> save(World& world, const RunProgress& progress, int number, bool at_once);
  std::string why_not() const;

 private:
  mutable std::mutex mutex_;
  std::string why_not_;
  double due_s_ = 0;
};

/// Keeps frames in so much memory, the newest last. Where it would be more, frames go: seldom the newest, and
/// never the first or the last, so the past is the sparser the longer ago it is.
template <class Frame>
class RunPast {
 public:
  struct Entry {
    std::shared_ptr<const Frame> frame;
    std::shared_ptr<const PastState> state;  ///< none where none could be saved
    int number = 0;
    std::size_t bytes = 0;  ///< of both
  };
  /// @param most_bytes 0: keeps none
  explicit RunPast(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void add(Entry entry) {
    if (most_bytes_ == 0) return;
    bytes_ += entry.bytes;
    entries_.push_back(std::move(entry));
    while (bytes_ > most_bytes_ && entries_.size() > 2) thin();
  }
  /// The run goes on from this frame again.
  void forget_after(int number) {
    for (; !entries_.empty() && entries_.back().number > number; entries_.pop_back())
      bytes_ -= entries_.back().bytes;
  }
  /// The frame of this number, or the nearest that is kept; nullptr: none is.
  const Entry* nearest(int number) const {
    if (entries_.empty()) return nullptr;
    const std::size_t after = std::min(place_of(number), entries_.size() - 1);
    const bool is_before_nearer =
        after > 0 && number - entries_[after - 1].number < entries_[after].number - number;
    return &entries_[is_before_nearer ? after - 1 : after];
  }
  /// The next that is kept before (steps < 0) or after a frame; the first or last where there are fewer.
  const Entry* moved(int number, int steps) const {
    if (entries_.empty()) return nullptr;
    const std::size_t here = place_of(number);
    std::ptrdiff_t at = static_cast<std::ptrdiff_t>(here) + steps;
    // The frame itself may be gone: then the one after it is the first step.
    if (steps > 0 && !(here < entries_.size() && entries_[here].number == number)) --at;
    const auto last = static_cast<std::ptrdiff_t>(entries_.size()) - 1;
    return &entries_[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(at, 0, last))];
  }
  /// The newest that has a state, up to this frame.
  std::shared_ptr<const PastState> state_at(int number) const {
    for (std::size_t i = place_of(number + 1); i > 0; --i)
      if (entries_[i - 1].state) return entries_[i - 1].state;
    return nullptr;
  }
  /// nullptr: none is kept.
  const Entry* first() const { return entries_.empty() ? nullptr : &entries_.front(); }
  const Entry* last() const { return entries_.empty() ? nullptr : &entries_.back(); }
  std::size_t bytes() const { return bytes_; }
  bool is_kept() const { return most_bytes_ > 0; }

 private:
  /// The frame goes whose neighbours are nearest to each other, measured by how long ago they are.
  void thin() {
    std::size_t goes = 1;
    double least = 1e300;
    const int newest = entries_.back().number;
    for (std::size_t i = 1; i + 1 < entries_.size(); ++i) {
      const double gap = entries_[i + 1].number - entries_[i - 1].number,
                   ago = 1 + newest - entries_[i].number;
      if (gap / ago >= least) continue;
      least = gap / ago;
      goes = i;
    }
    bytes_ -= entries_[goes].bytes;
    entries_.erase(entries_.begin() + static_cast<std::ptrdiff_t>(goes));
  }
  /// Where the entry of this number is, or the first after it.
  std::size_t place_of(int number) const {
    const auto at = std::lower_bound(entries_.begin(), entries_.end(), number,
                                     [](const Entry& e, int n) { return e.number < n; });
    return static_cast<std::size_t>(at - entries_.begin());
  }

  const std::size_t most_bytes_;
  std::vector<Entry> entries_;
  std::size_t bytes_ = 0;
};

}  // namespace tactus
