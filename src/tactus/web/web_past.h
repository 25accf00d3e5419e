#pragma once
/// Frames that viewers saw, to look at again and to simulate again from.
#include <functional>
#include <mutex>

#include "tactus/run/run_past.h"

namespace tactus {

/// Keeps frames as messages, and decides which frame viewers see: the newest, or an older one that somebody
/// asked for. Thread-safe.
class WebPast {
 public:
  using Bytes = std::shared_ptr<const std::string>;
  struct Options {
    std::size_t most_bytes = 0;       ///< of messages and states; 0: only the newest frame is seen
    std::function<void(Bytes)> show;  ///< to all viewers; called with the lock, so its calls have an order
    std::function<void()> changed;    ///< another frame is seen; called without it
  };
  explicit WebPast(Options options) : options_(std::move(options)), past_(options_.most_bytes) {}

  /// Counts how often the run went back: frames that were made before don't count after it.
  int run() const;
  /// Shows a frame, unless an older one is looked at.
  void add(const Bytes& message, int number, int run, std::shared_ptr<const PastState> state);
  /// Shows the nearest to this number. @throws Error where none is kept.
  void see(int number);
  /// Goes through those that are kept. @throws Error likewise.
  void move(int steps);
  /// Shows the newest.
  void leave();
  /// The run is to go back to the frame that is looked at. @throws Error where none is, or none has a state.
  void ask_again();
  /// The state for it. The frames after it are forgotten, and it is the newest.
  std::shared_ptr<const PastState> go_back();

  /// Numbers of frames; 0: none.
  struct Shown {
    int first = 0, last = 0;
    int seen = 0;        ///< the older one that is looked at
    int again_from = 0;  ///< from where it would be simulated again
  };
  Shown shown() const;

 private:
  using Entry = RunPast<std::string>::Entry;
  void see(const Entry* entry);

  Options options_;
  mutable std::mutex mutex_;
  RunPast<std::string> past_;
  std::shared_ptr<const PastState> again_;
  int run_ = 0, seen_ = 0;
};

}  // namespace tactus
