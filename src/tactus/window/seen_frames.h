#pragma once
/// The past of a run: frames that were seen, and the states after them.
#include <memory>
#include <mutex>

#include "tactus/run/run_past.h"
#include "tactus/window/viewed_frame.h"

namespace tactus {

struct SeenFrame {
  std::shared_ptr<const ViewedFrame> frame;
  std::shared_ptr<const PastState> state;  ///< none where none could be saved
};

/// Bytes of a frame's meshes, particles and photographs.
std::size_t bytes_of(const ViewedFrame& frame);

/// A RunPast between the threads of the physics and of the window.
class SeenFrames {
 public:
  /// @param most_bytes 0: keeps none
  explicit SeenFrames(std::size_t most_bytes) : past_(most_bytes) {}

  void add(SeenFrame seen);
  void clear();
  /// The run goes on from this frame again.
  void forget_after(int number);
  /// The frame of this number, or the nearest that is kept.
  SeenFrame nearest(int number) const;
  /// The next that is kept before (steps < 0) or after a frame; the first or last where there are fewer.
  SeenFrame moved(int number, int steps) const;
  /// The newest that has a state, up to this frame.
  std::shared_ptr<const PastState> state_at(int number) const;
  /// Numbers of the frames that are kept, from the first to the last; 0 for none.
  struct Range {
    int first = 0, last = 0;
  };
  Range range() const;
  std::size_t bytes() const;
  bool is_kept() const { return past_.is_kept(); }

 private:
  mutable std::mutex mutex_;
  RunPast<ViewedFrame> past_;
};

}  // namespace tactus
