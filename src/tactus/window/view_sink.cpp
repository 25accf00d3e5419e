#include "tactus/window/view_sink.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"

namespace tactus {
namespace {

/// Percentiles sort thousands of times.
constexpr double kStagesEvery_s = 0.5;
constexpr std::size_t kMostArrows = 200, kMostNotices = 6;

double millilitres(Index particles, const LiquidDescription& liquid) {
  return 1e6 * particles * liquid.spacing_m * liquid.spacing_m * liquid.spacing_m;
}

}  // namespace

ViewSink::ViewSink(const Scene& scene, World& world, RunControl& control,
                   NewestOne<std::shared_ptr<const ViewedFrame>>& newest, std::function<void()> on_news,
                   Options options)
    : scene_(scene),
      world_(world),
      control_(control),
      newest_(newest),
      on_news_(std::move(on_news)),
      options_(std::move(options)) {
  number_ = options_.frames_before;
  for (const BodyDescription& body : scene.bodies) world.report_contacts(body.name);
}

bool ViewSink::may_go_on() {
  turn_ = control_.wait_for_turn(is_unseen_);
  if (turn_ != RunControl::Turn::go) return false;
  apply_control();
  return true;
}

void ViewSink::apply_control() {
  const RunControl::Applied applied = control_.apply(world_);
  if (applied.has_asked) refusal_ = applied.errors;
  if (applied.has_set || parameters_ == nullptr) {
    const auto list = world_.parameters().of(ParameterEffect::next_frame);
    parameters_ = std::make_shared<const std::vector<SceneParameter>>(list.begin(), list.end());
  }
}

void ViewSink::frame(RunFrame& frame) {
  control_.note_frame(frame.images.time_s, frame.report.dt_s);
  number_ = frame.number + options_.frames_before;
  // A frame that would replace another unseen isn't copied; when it is paused, the last one is seen.
  is_unseen_ = !newest_.is_empty() && !control_.is_paused();
  if (is_unseen_) {
    unseen_ = seen(frame);
    return;
  }
  hand_over(seen(frame), frame.notices);
}

void ViewSink::end(RunNotices& notices) {
  if (is_unseen_ && turn_ == RunControl::Turn::go) hand_over(std::move(unseen_), notices);
  is_unseen_ = false;
}

ViewSink::Seen ViewSink::seen(const RunFrame& frame) const {
  Seen seen{number_, frame.images.time_s, frame.taken_at_s, 0, frame.report, {}};
  if (frame.is_new) seen.captured_s = frame.images.captured_s;
  if (options_.wears_photographs) seen.photos = frame.images.colors;
  return seen;
}

void ViewSink::hand_over(Seen seen, const RunNotices& noted) {
  auto shown = std::make_shared<ViewedFrame>();
  shown->snapshot = std::make_shared<const FrameSnapshot>(world_.snapshot());
  shown->photos = std::move(seen.photos);
  shown->number = seen.number;
  shown->time_s = seen.time_s;
  shown->shown_at_s = now_s();
  shown->budget_ms = options_.budget_ms;
  shown->substeps = seen.report.substeps;
  shown->frame_ms = 1e3 * (shown->shown_at_s - seen.taken_at_s);
  if (seen.captured_s > 0) shown->latency_ms = 1e3 * (shown->shown_at_s - seen.captured_s);
  const Timings& timings = world_.timings();
  if (shown->shown_at_s - staged_s_ > kStagesEvery_s) {
    staged_s_ = shown->shown_at_s;
    stages_.clear();
    for (const std::string& stage : timings.stages())
      stages_.push_back({stage, timings.percentile_ms(stage, 50), timings.percentile_ms(stage, 99)});
  }
  shown->stages = stages_;
  shown->parameters = parameters_;
  shown->refusal = refusal_;
  add_values(seen.report, *shown);
  add_contacts(seen.report.dt_s, *shown);
  const std::vector<Notice>& notices = noted.notices();
  for (std::size_t i = notices.size() - std::min(notices.size(), kMostNotices); i < notices.size(); ++i)
    shown->notices.push_back(notices[i].text + (notices[i].remedy.empty() ? "" : "; " + notices[i].remedy));
  if (options_.seen) options_.seen(shown);
  newest_.put(std::move(shown));
  if (on_news_) on_news_();
}

void ViewSink::add_values(const StepReport& report, ViewedFrame& shown) {
  shown.values.push_back({"frame", "ms", shown.frame_ms});
  double touch_N = 0;
  for (const std::string& tool : options_.tools) shown.tools.push_back({tool, world_.pose(tool), 0});
  for (const BodyContact& c : report.contacts) {
    const auto force_N = static_cast<double>(length(c.reaction.force_N));
    touch_N += force_N;
    for (ViewedTool& tool : shown.tools)
      if (c.component == tool.name) tool.force_N += force_N;
  }
  if (!scene_.bodies.empty()) shown.values.push_back({"contact", "N", touch_N});
  shown.pull_N = length(report.grab_N);
  const std::vector<BodyMonitors> monitors = world_.monitors();
  double elastic_J = 0, kinetic_J = 0, least_J = 1;
  for (const BodyMonitors& m : monitors) {
    elastic_J += m.elastic_J;
    kinetic_J += m.kinetic_J;
    least_J = std::min(least_J, m.min_J);
  }
  if (!monitors.empty()) {
    if (elastic_J > 0) shown.values.push_back({"elastic energy", "mJ", 1e3 * elastic_J});
    shown.values.push_back({"kinetic energy", "mJ", 1e3 * kinetic_J});
    shown.values.push_back({"smallest J", "", least_J});
  }
  if (scene_.fluid) shown.values.push_back({"liquid", "ml", millilitres(report.liquid.here, *scene_.fluid)});
  double cut_cm2 = 0;
  for (const CutScore& cut : world_.cuts()) cut_cm2 += 1e4 * cut.area_m2;
  if (!scene_.blades.empty()) shown.values.push_back({"cut", "cm2", cut_cm2});
}

void ViewSink::add_contacts(double dt_s, ViewedFrame& shown) {
  if (!(dt_s > 0)) return;
  const auto per_s = static_cast<float>(1 / dt_s);
  std::size_t count = 0;
  for (const BodyDescription& body : scene_.bodies) count += world_.contacts(body.name).size();
  const std::size_t every = 1 + count / kMostArrows;
  std::size_t number = 0;
  for (const BodyDescription& body : scene_.bodies) {
    for (const BodyPointContact& c : world_.contacts(body.name)) {
      if (c.point < 0 || number++ % every != 0) continue;
      shown.contacts.push_back({c.point_m, per_s * c.impulse_N_s});
    }
  }
}

}  // namespace tactus
