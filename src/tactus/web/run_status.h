#pragma once
/// Stage times, monitors and notices of a run as JSON, for its viewers.
#include <memory>
#include <string>
#include <vector>

#include "tactus/run/frame_sink.h"

namespace tactus {

/// Looks at every frame and makes a new text four times a second: monitors copy nodes to the host.
///   {"stages": [{name, last_ms, p50_ms, p99_ms}], "budget_ms": ..., "bodies": [...], "liquid": {...},
///   "notices": [...]}
class RunStatus {
 public:
  /// @param held obstacles whose poses are told
  /// @param budget_s of a frame; 0: the time from frame to frame
  explicit RunStatus(std::vector<std::string> held = {}, double budget_s = 0)
      : held_(std::move(held)), budget_s_(budget_s) {}
  /// The newest text. Synchronizes where it is made anew. @param is_paused no frame follows soon: it is made
  /// anew, with the hash of the state
  std::shared_ptr<const std::string> look(RunFrame& frame, bool is_paused = false);
  /// The run goes on from an earlier frame, in another world.
  void forget();
  void set_frames_in_all(std::optional<int> frames) { frames_in_all_ = frames; }

 private:
  /// Percentiles are of so many frames.
  static constexpr std::size_t kFrames = 240;
  static constexpr double kPeriod_s = 0.25;
  struct Stage {
    std::string name;
    std::vector<double> ms;  ///< a ring
    std::size_t next = 0;
  };
  void add_times(const Timings& timings);
  std::string text(RunFrame& frame, bool has_hash);

  std::vector<std::string> held_;
  std::vector<Stage> stages_;
  std::shared_ptr<const std::string> text_;
  std::optional<int> frames_in_all_;
  double budget_s_, frame_s_ = 0, made_s_ = 0;
};

}  // namespace tactus
