#pragma once
/// A time that frames may take.
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tactus/perception/frame_quality.h"
#include "tactus/run/frame_sink.h"

namespace tactus {

/// Selects the work that a simulation leaves out, by the time that frames took: from their images to this
/// sink, which is therefore the last one.
class BudgetSink final : public FrameSink {
 public:
  /// @param draws_photographs the run's pictures show the real surface in photographs
  BudgetSink(double budget_s, World& world, bool draws_photographs);

  /// Notes each change of the selection.
  void frame(RunFrame& frame) override;
  /// Notes when most frames took longer though all was left out that can be.
  void end(RunNotices& notices) override;
  bool leaves_out_photographs() const {
    return made_ > 0 && quality_reductions_.front() == QualityReduction::photographs;
  }
  nlohmann::json to_json() const;

 private:
  World& world_;
  std::vector<QualityReduction> quality_reductions_;
  FrameBudget budget_;
  std::size_t made_ = 0;
  std::vector<double> frame_ms_;
  std::vector<std::size_t> reductions_made_;
  std::vector<double> counted_s_;  ///< of frames with new images
};

}  // namespace tactus
