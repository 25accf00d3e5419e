#include "tactus/window/panel_model.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace tactus {
namespace {

constexpr std::size_t kMostStages = 14;
/// A slider shows limits whole that are no farther from each other.
constexpr double kNearLimits = 2;
constexpr double kPaceOver_s = 1;
constexpr double kMostBudgets = 2;

std::string with_unit(double value, const std::string& unit) {
  return short_number(value) + (unit.empty() ? "" : " " + unit);
}

std::string state_text(LiveRun::State state, bool is_paused, double pace) {
  if (state == LiveRun::State::building) return "building the scene ...";
  if (state == LiveRun::State::ended) return "the source has ended: r starts again";
  if (state == LiveRun::State::failed) return "failed";
  if (is_paused) return "paused: space goes on, . makes one step";
  if (pace <= 0) return "running";
  return pace > 0.97 && pace < 1.03 ? "running in real time"
                                    : "running at " + short_number(pace) + " of real time";
}

const char* state_word(LiveRun::State state, bool is_paused) {
  switch (state) {
    case LiveRun::State::building:
      return "building";
    case LiveRun::State::ended:
      return "ended";
    case LiveRun::State::failed:
      return "failed";
    case LiveRun::State::running:
      break;
  }
  return is_paused ? "paused" : "running";
}

/// "capture to set" and the like are parts of the age of live images, not of the frame.
bool is_age(const StageTime& s) { return s.name == "latency" || s.name.find(" to ") != std::string::npos; }

/// Milliseconds of the bars' whole width: the budget, so that a bar is a share of it. Where a stage takes
/// longer, up to twice as much; a bar that is still longer is cut off.
double whole_ms(const std::vector<StageTime>& stages, double budget_ms) {
  double longest_ms = 1e-6;
  for (const StageTime& s : stages)
    if (!(budget_ms > 0 && is_age(s)) && s.name != "latency") longest_ms = std::max(longest_ms, s.p99_ms);
  return budget_ms > 0 ? std::clamp(longest_ms, budget_ms, kMostBudgets * budget_ms) : longest_ms;
}

std::string stage_text(const StageTime& s, double budget_ms) {
  const bool has_budget = budget_ms > 0 && !is_age(s);
  const char* word = !has_budget || s.p99_ms <= budget_ms ? ""
                     : s.p50_ms > budget_ms               ? "over: "
                                                          : "p99 over: ";
  return word + short_number(s.p50_ms) + " / " + short_number(s.p99_ms);
}

/// The stages that take most, in the order of the frame.
std::vector<PanelModel::Stage> stage_bars(std::vector<StageTime> stages, double budget_ms) {
  const double whole = whole_ms(stages, budget_ms);
  const auto share = [whole](double ms) { return static_cast<float>(std::min(1.0, ms / whole)); };
  std::vector<double> p50;
  // The time from images to frame is no stage.
  std::erase_if(stages, [](const StageTime& s) { return s.name == "latency"; });
  for (const StageTime& s : stages) p50.push_back(s.p50_ms);
  std::sort(p50.begin(), p50.end(), std::greater<>());
  const double least_ms = p50.size() > kMostStages ? p50[kMostStages - 1] : 0;
  // A whole frame stands before its parts.
  std::stable_partition(stages.begin(), stages.end(), [](const StageTime& s) { return s.name == "frame"; });
  std::vector<PanelModel::Stage> bars;
  for (const StageTime& s : stages) {
    if (s.p50_ms < least_ms || bars.size() == kMostStages) continue;
    bars.push_back({s.name, stage_text(s, budget_ms), share(s.p50_ms), share(s.p99_ms),
                    static_cast<float>(s.p50_ms), is_age(s)});
  }
  return bars;
}

/// Scaled to its own range; a curve that stays is in the middle.
PanelModel::Curve curve_of(const RunHistory::Curve& from) {
  const auto [low, high] = std::minmax_element(from.values.begin(), from.values.end());
  const float range = *high - *low;
  PanelModel::Curve curve{
      from.name,
      with_unit(static_cast<double>(from.values.back()), from.unit),
      short_number(static_cast<double>(*low)) + " to " + short_number(static_cast<double>(*high)),
      {}};
  for (const float v : from.values) curve.heights.push_back(range > 0 ? (v - *low) / range : 0.5F);
  return curve;
}

}  // namespace

std::string short_number(double value) {
  char text[32];
  const double size = std::abs(value);
  if (size == 0) return "0";
  if (size >= 1e5 || size < 5e-4)
    std::snprintf(text, sizeof text, "%.1e", value);
  else
    std::snprintf(text, sizeof text, "%.*f",
                  size >= 99.95    ? 0
                  : size >= 9.995  ? 1
                  : size >= 0.0995 ? 2
                                   : 3,
                  value);
  return text;
}

std::vector<HelpLine> help_lines(const MouseHolds& holds) {
  std::vector<HelpLine> lines{{"left drag", "orbit"},
                              {"right or middle drag", "pan"},
                              {"wheel", "nearer, farther"},
                              {"space", "pause, go on"},
                              {".", "one frame, then pause"},
                              {"r", "start again"},
                              {"left, right, Home, End", "through what was seen"},
                              {"b", "simulate again from there"},
                              {"k; then b", "keep this frame; back to it"},
                              {"c", "contacts as arrows"},
                              {"i", "images of the cameras"},
                              {"v", "the scene's own view"},
                              {"s", "save the picture, without panels"},
                              {"tab", "panels"},
                              {"h", "this help"},
                              {"q", "close"}};
  if (holds.tissue) lines.insert(lines.begin() + 3, {"ctrl + left drag", "grab tissue and pull it"});
  if (holds.tools > 1) lines.insert(lines.begin() + 3, {"t", "take the next tool"});
  if (holds.tools > 0) {
    lines.insert(lines.begin() + 3, {"shift + wheel", "tool away, towards you"});
    lines.insert(lines.begin() + 3, {"shift + left drag", "hold the tool, cut with it"});
  }
  return lines;
}

PanelModel::Slider slider_of(const SceneParameter& p, double scene_value) {
  PanelModel::Slider slider{p.name, p.name, p.unit, p.meaning, p.value};
  if (slider.label.starts_with("bodies.")) slider.label.erase(0, 7);
  const double size = std::abs(scene_value);
  if (std::isfinite(p.least) && std::isfinite(p.most) && p.most - p.least <= kNearLimits) {
    slider.low = p.least;
    slider.high = p.most;
  } else if (p.least < 0) {
    slider.low = std::max(p.least, size > 0 ? -2 * size : -10);
    slider.high = std::min(p.most, size > 0 ? 2 * size : 10);
  } else {
    slider.low = size > 0 ? std::max(p.least, 0.1 * size) : p.least;
    slider.high = std::min(p.most, size > 0 ? 10 * size : p.least + 1);
  }
  slider.is_logarithmic = slider.low > 0 && slider.high >= 50 * slider.low;
  slider.low = std::min(slider.low, p.value);
  slider.high = std::max(slider.high, p.value);
  return slider;
}

void RunHistory::clear() {
  scene_parameters_.clear();
  newest_.reset();
  curves_.clear();
  times_.clear();
}

void RunHistory::add(std::shared_ptr<const ViewedFrame> frame) {
  for (const ViewedValue& v : frame->values) {
    auto curve =
        std::find_if(curves_.begin(), curves_.end(), [&](const Curve& c) { return c.name == v.name; });
    if (curve == curves_.end()) curve = curves_.insert(curve, {v.name, v.unit, {}});
    if (curve->values.size() == kMostSamples) curve->values.erase(curve->values.begin());
    curve->values.push_back(std::isfinite(v.value) ? static_cast<float>(v.value) : 0);
  }
  if (scene_parameters_.empty() && frame->parameters) scene_parameters_ = *frame->parameters;
  times_.emplace_back(frame->time_s, frame->shown_at_s);
  while (times_.back().second - times_.front().second > kPaceOver_s) times_.erase(times_.begin());
  newest_ = std::move(frame);
}

double RunHistory::pace() const {
  if (times_.size() < 3) return 0;
  const double shown_s = times_.back().second - times_.front().second;
  return shown_s > 0.3 * kPaceOver_s ? (times_.back().first - times_.front().first) / shown_s : 0;
}

namespace {

std::vector<PanelModel::Slider> sliders(const ViewedFrame& frame,
                                        const std::vector<SceneParameter>& scene_parameters,
                                        const std::map<std::string, double>& pending) {
  std::vector<PanelModel::Slider> all;
  if (!frame.parameters) return all;
  for (std::size_t i = 0; i < frame.parameters->size(); ++i) {
    SceneParameter p = (*frame.parameters)[i];
    if (const auto set = pending.find(p.name); set != pending.end()) p.value = set->second;
    all.push_back(slider_of(p, i < scene_parameters.size() ? scene_parameters[i].value : p.value));
  }
  return all;
}

PanelModel::Past past_slider(const ShownPast& past, int newest) {
  PanelModel::Past shown{past.range.first, past.range.last, past.frame ? past.frame->number : newest, "",
                         false};
  if (shown.first >= shown.last) return shown;
  shown.text = "seen: frames " + std::to_string(shown.first) + " to " + std::to_string(shown.last);
  if (!past.frame) return shown;
  shown.can_go_on_from = past.again_from > 0;
  if (shown.can_go_on_from)
    shown.text = "b: simulate again from frame " + std::to_string(past.again_from);
  else if (!past.why_not_again.empty())
    shown.text = past.why_not_again;
  else
    shown.text = "no state of this frame was saved";
  return shown;
}

}  // namespace

PanelModel panel_model(const std::string& name, const RunHistory& history, LiveRun::State state,
                       bool is_paused, const std::map<std::string, double>& pending, int kept_frame,
                       const std::string& tool, const ShownPast& past) {
  PanelModel model;
  model.state = past.frame ? "the past: End shows the present" : state_text(state, is_paused, history.pace());
  model.title = "tactus: " + name + ", " + state_word(state, is_paused);
  if (kept_frame > 0) model.kept = "b goes back to frame " + std::to_string(kept_frame);
  const ViewedFrame* frame = past.frame ? past.frame.get() : history.newest();
  if (frame == nullptr) return model;
  model.past = past_slider(past, history.newest()->number);
  char text[96];
  std::snprintf(text, sizeof text, "%.2f s, frame %d", frame->time_s, frame->number);
  model.clock = text;
  model.title += ", frame " + std::to_string(frame->number);
  if (frame->latency_ms > 0) model.clock += ", " + short_number(frame->latency_ms) + " ms after its images";
  for (const ViewedTool& t : frame->tools)
    if (t.name == tool)
      model.tool = "in the hand: " + tool + (t.force_N > 0 ? ", " + with_unit(t.force_N, "N") : "") +
                   (frame->tools.size() > 1 ? " (t: next)" : "");
  if (frame->pull_N > 0) model.pull = "pull: " + with_unit(frame->pull_N, "N");
  float longest_N = 0;
  for (const ContactArrow& c : frame->contacts) longest_N = std::max(longest_N, length(c.force_N));
  const auto shows = [frame](const char* value) {
    return std::any_of(frame->values.begin(), frame->values.end(),
                       [value](const ViewedValue& v) { return v.name == value; });
  };
  // A line that came and went would move all below it.
  if (shows("contact"))
    model.arrows =
        longest_N > 0 ? "longest arrow: " + with_unit(static_cast<double>(longest_N), "N") : "no contacts";
  model.stages = stage_bars(frame->stages, frame->budget_ms);
  if (frame->budget_ms > 0) {
    model.budget = "budget of a frame: " + short_number(frame->budget_ms) + " ms";
    model.budget_at = static_cast<float>(frame->budget_ms / whole_ms(frame->stages, frame->budget_ms));
  }
  for (const RunHistory::Curve& curve : history.curves()) model.curves.push_back(curve_of(curve));
  if (shows("contact") || shows("liquid"))  // cameras alone have nothing to set
    model.sliders = sliders(*frame, history.scene_parameters(), pending);
  model.notices = frame->notices;
  if (!frame->refusal.empty()) model.notices.push_back(frame->refusal);
  return model;
}

}  // namespace tactus
