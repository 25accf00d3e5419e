#include "tactus/run/sinks/budget_sink.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"

namespace tactus {
namespace {

std::vector<QualityReduction> quality_reductions_of(const World& world, bool draws_photographs) {
  std::vector<QualityReduction> all = world.quality_reductions();
  if (draws_photographs) all.insert(all.begin(), QualityReduction::photographs);
  return all;
}

std::string ms_text(double seconds) { return number_text(std::round(1e4 * seconds) / 10) + " ms"; }

}  // namespace

BudgetSink::BudgetSink(double budget_s, World& world, bool draws_photographs)
    : world_(world),
      quality_reductions_(quality_reductions_of(world, draws_photographs)),
      budget_(budget_s, quality_reductions_.size()) {}

void BudgetSink::frame(RunFrame& frame) {
  const double frame_s = now_s() - frame.taken_at_s;
  frame_ms_.push_back(1e3 * frame_s);
  reductions_made_.push_back(made_);
  if (!frame.is_new) return;
  counted_s_.push_back(frame_s);
  const std::size_t before = made_;
  made_ = budget_.next(frame_s, now_s());
  if (made_ == before) return;
  world_.reduce_quality(std::span(quality_reductions_).first(made_));
  const std::string when = "after frame " + std::to_string(frame.images.tick) + ", which took " +
                           ms_text(frame_s) + " of " + ms_text(budget_.budget_s()) + ": ";
  if (made_ > before)
    frame.notices.note(Notice{"budget.less", Severity::info,
                              when + quality_reduction_text(quality_reductions_[before]), ""});
  else
    frame.notices.note(Notice{"budget.more", Severity::info,
                              when + "no longer: " + quality_reduction_text(quality_reductions_[made_]), ""});
}

void BudgetSink::end(RunNotices& notices) {
  if (made_ < quality_reductions_.size() ||
      2 * static_cast<std::size_t>(budget_.frames_above()) <= counted_s_.size())
    return;
  std::vector<double> sorted = counted_s_;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  notices.note(Notice{"budget.missed", Severity::warning,
                      "the budget of " + ms_text(budget_.budget_s()) + " was missed in " +
                          std::to_string(budget_.frames_above()) + " of " +
                          std::to_string(counted_s_.size()) +
                          " frames, and nothing more can be left out; half of them took " +
                          ms_text(sorted[sorted.size() / 2]) + " or more",
                      "take a coarser 'reconstruction.resolution' or 'spacing_m', or a faster device"});
}

nlohmann::json BudgetSink::to_json() const {
  return {{"ms", 1e3 * budget_.budget_s()},
          {"frames_above", budget_.frames_above()},
          {"frame_ms", frame_ms_},
          {"quality_reductions", reductions_made_}};
}

}  // namespace tactus
