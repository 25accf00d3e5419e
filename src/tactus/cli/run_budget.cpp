#include "tactus/cli/run_budget.h"

#include <charconv>
#include <cmath>

#include "tactus/base/error.h"

namespace tactus {
namespace {

std::vector<Saving> savings_of(const Simulation& simulation, bool draws_photographs) {
  std::vector<Saving> all = simulation.savings();
  if (draws_photographs) all.insert(all.begin(), Saving::photographs);
  return all;
}

std::string ms_text(double seconds) { return number_text(std::round(1e4 * seconds) / 10) + " ms"; }

}  // namespace

double parse_budget_s(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  const double seconds = unit == "s" ? value : 1e-3 * value;
  const bool is_known = unit.empty() || unit == "ms" || unit == "s";
  if (error != std::errc() || !is_known || !(seconds >= 1e-4 && seconds <= 10))
    throw usage_error("--budget '" + text +
                      "': expected the time of a frame, as 11ms or 0.011s, 0.1 ms to 10 s");
  return seconds;
}

RunBudget::RunBudget(double budget_s, Simulation& simulation, bool draws_photographs)
    : simulation_(simulation),
      savings_(savings_of(simulation, draws_photographs)),
      budget_(budget_s, savings_.size()) {}

std::vector<Notice> RunBudget::add(std::int64_t tick, double frame_s, bool is_new) {
  frame_ms_.push_back(1e3 * frame_s);
  savings_made_.push_back(made_);
  if (!is_new) return {};
  const std::size_t before = made_;
  made_ = budget_.next(frame_s, now_s());
  if (made_ == before) return {};
  simulation_.save(std::span(savings_).first(made_));
  const std::string when = "after frame " + std::to_string(tick) + ", which took " + ms_text(frame_s) +
                           " of " + ms_text(budget_.budget_s()) + ": ";
  if (made_ > before) return {{"budget.less", Severity::info, when + saving_text(savings_[before]), ""}};
  return {{"budget.more", Severity::info, when + "no longer: " + saving_text(savings_[made_]), ""}};
}

nlohmann::json RunBudget::to_json() const {
  return {{"ms", 1e3 * budget_.budget_s()},
          {"frames_above", budget_.frames_above()},
          {"frame_ms", frame_ms_},
          {"savings", savings_made_}};
}

}  // namespace tactus
