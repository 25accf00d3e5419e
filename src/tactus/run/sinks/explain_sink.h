#pragma once
/// When, where and why bodies are strained badly.
#include <map>
#include <string>

#include "tactus/run/sinks/crush_sink.h"
#include "tactus/sim/body/soft_body.h"

namespace tactus {

/// Prints a line for each stretch of frames in which something is wrong, once it is over, with its worst
/// frame.
class ExplainSink final : public FrameSink {
 public:
  explicit ExplainSink(const Scene& scene) : substeps_are_given_(scene.frame.substeps.has_value()) {}
  void frame(RunFrame& frame) override;
  /// Prints the stretches that are still open.
  void end(RunNotices& notices) override;

 private:
  struct Stretch {
    std::int64_t first = 0, last = 0, worst_tick = 0;
    double worst = 0;
    std::string text;  ///< of the worst frame
  };
  /// @param key whose stretch it is @param badness larger is worse @param text made only when it is needed
  template <class Text>
  void note(const std::string& key, std::int64_t tick, double badness, Text&& text);
  void note_body(const StepReport& report, SoftBody& body, ExecContext& ctx, std::int64_t tick);
  static void print(const Stretch& stretch);

  bool substeps_are_given_;
  std::map<std::string, Stretch> open_;
};

}  // namespace tactus
