#pragma once
/// Wall-clock time of named stages, their percentiles, and a Chrome trace (chrome://tracing,
/// ui.perfetto.dev).
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace tactus {

/// Seconds since an arbitrary start, monotonic.
inline double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// p-th percentile (0..100) of the samples, linear between neighbours; 0 for none.
double percentile(std::vector<double> samples, double p);

/// Collects how long each stage took, frame after frame. Thread-safe. Memory is bounded: of each stage the
/// newest 8192 durations count (91 s at 90 Hz), and a trace holds the first 200,000 events.
class Timings {
 public:
  static constexpr std::size_t kMostSamples = 8192, kMostEvents = 200000;
  /// Keep begin and end of every stage for `write_trace` (off: only durations).
  explicit Timings(bool keep_trace = false) : keep_trace_(keep_trace) {}
  /// From now on, the durations of a stage are summed until the next begin_frame(): a frame may run in parts,
  /// and a stage several times in it. Without it, each duration counts for itself.
  void begin_frame();
  void add(const std::string& stage, double begin_s, double end_s, int track = 0);
  /// Duration of the newest sample of a stage [ms]; 0 when it never ran.
  double last_ms(const std::string& stage) const;
  double percentile_ms(const std::string& stage, double p) const;
  /// Number of durations of a stage that count (at most kMostSamples).
  std::size_t count(const std::string& stage) const;
  /// Stages in the order in which they first ran.
  std::vector<std::string> stages() const;
  /// Writes the Chrome trace JSON. @throws Error when the file can't be written.
  void write_trace(const std::string& path) const;
  void clear();

 private:
  struct Event {
    std::string stage;
    double begin_s, end_s;
    int track;
  };
  bool keep_trace_;
  mutable std::mutex mutex_;
  std::vector<std::string> order_;
  struct Samples {
    std::vector<double> ms;  ///< a ring
    std::size_t newest = 0;
    std::int64_t frame = 0;  ///< of the newest
  };
  std::int64_t frame_ = 0;  ///< 0: there are no frames
  std::map<std::string, Samples> samples_;
  std::vector<Event> events_;
};

/// Times a scope: `StageTimer t(timings, "hull");`
class StageTimer {
 public:
  StageTimer(Timings& timings, std::string stage, int track = 0)
      : timings_(timings), stage_(std::move(stage)), begin_s_(now_s()), track_(track) {}
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;
  ~StageTimer() { timings_.add(stage_, begin_s_, now_s(), track_); }

 private:
  Timings& timings_;
  std::string stage_;
  double begin_s_;
  int track_;
};

}  // namespace tactus
