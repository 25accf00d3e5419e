#pragma once
/// `tactus run --explain`: when, where and why bodies are strained badly.
#include <map>
#include <string>

#include "tactus/sim/simulation.h"

namespace tactus {

/// Less than this of its volume at rest is bad strain.
inline constexpr double kBadVolume = 0.3;

/// Prints a line for each stretch of frames in which something is wrong, once it is over, with its worst
/// frame.
class RunExplainer {
 public:
  explicit RunExplainer(const Scene& scene) : substeps_are_given_(scene.frame.substeps.has_value()) {}
  /// After each frame.
  void add(const StepReport& report, Simulation& simulation, std::int64_t tick);
  /// What is not over yet.
  void finish();

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
