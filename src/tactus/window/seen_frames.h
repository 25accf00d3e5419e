#pragma once
/// The past of a run: frames that were seen, and the states after them.
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tactus/run/frame_loop.h"
#include "tactus/window/viewed_frame.h"

namespace tactus {

/// All that the coming frames depend on, and how far the source had come.
struct SavedState {
  std::string bytes;  ///< World::save_state
  RunProgress progress;
  int number = 0;  ///< of the frame after which it was saved
};

struct SeenFrame {
  std::shared_ptr<const ViewedFrame> frame;
  std::shared_ptr<const SavedState> state;  ///< none where none could be saved
};

/// Bytes of a frame's meshes, particles and photographs.
std::size_t bytes_of(const ViewedFrame& frame);

/// Keeps frames in so much memory, the newest last. Where it would be more, frames go: seldom the newest, and
/// never the first or the last, so the past is the sparser the longer ago it is. Thread-safe.
class SeenFrames {
 public:
  /// @param most_bytes 0: keeps none
  explicit SeenFrames(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  void add(SeenFrame seen);
  void clear();
  /// The run goes on from this frame again.
  void forget_after(int number);
  /// The frame of this number, or the nearest that is kept.
  SeenFrame nearest(int number) const;
  /// The next that is kept before (steps < 0) or after a frame; the first or last where there are fewer.
  SeenFrame moved(int number, int steps) const;
  /// The newest that has a state, up to this frame.
  std::shared_ptr<const SavedState> state_at(int number) const;
  /// Numbers of the frames that are kept, from the first to the last; 0 for none.
  struct Range {
    int first = 0, last = 0;
  };
  Range range() const;
  std::size_t bytes() const;
  bool is_kept() const { return most_bytes_ > 0; }

 private:
  struct Entry {
    SeenFrame seen;
    int number = 0;
    std::size_t bytes = 0;
  };
  void thin();
  /// Where the entry of this number is, or the first after it.
  std::size_t place_of(int number) const;

  const std::size_t most_bytes_;
  mutable std::mutex mutex_;
  std::vector<Entry> entries_;
  std::size_t bytes_ = 0;
};

}  // namespace tactus
