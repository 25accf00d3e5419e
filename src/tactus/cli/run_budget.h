#pragma once
/// `tactus run --budget 11ms`.
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tactus/sim/simulation.h"

namespace tactus {

/// "11ms" or "0.011s" in seconds. @throws usage Error naming the flag.
double parse_budget_s(const std::string& text);

/// Tells a simulation what to leave out, by how long frames took.
class RunBudget {
 public:
  /// @param draws_photographs the run's pictures show the real surface in photographs
  RunBudget(double budget_s, Simulation& simulation, bool draws_photographs);

  /// After a frame. @param is_new it had new images, and counts @returns what changes, for the run's notices.
  std::vector<Notice> add(std::int64_t tick, double frame_s, bool is_new);
  bool leaves_out_photographs() const { return made_ > 0 && savings_.front() == Saving::photographs; }
  /// When most frames took longer though all was left out that can be: a notice for the run's end.
  std::optional<Notice> verdict() const;
  nlohmann::json to_json() const;

 private:
  Simulation& simulation_;
  std::vector<Saving> savings_;
  FrameBudget budget_;
  std::size_t made_ = 0;
  std::vector<double> frame_ms_;
  std::vector<std::size_t> savings_made_;
  std::vector<double> counted_s_;  ///< of frames with new images
};

}  // namespace tactus
