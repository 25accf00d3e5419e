#include "tactus/web/run_status.h"

#include <algorithm>

#include "tactus/geom/maths/rotation.h"
#include "tactus/web/json_text.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

constexpr std::size_t kMostNotices = 20;

nlohmann::json notices_json(const RunNotices& notices) {
  nlohmann::json json = nlohmann::json::array();
  const std::vector<Notice>& all = notices.notices();
  for (std::size_t i = all.size() - std::min(all.size(), kMostNotices); i < all.size(); ++i)
    json.push_back({{"code", all[i].code},
                    {"severity", severity_text(all[i].severity)},
                    {"text", all[i].text},
                    {"remedy", all[i].remedy}});
  return json;
}

nlohmann::json body_json(const SoftBody& body, const BodyMonitors& monitors, const StepReport& report) {
  Vec3f force_N{};
  for (const BodyContact& c : report.contacts)
    if (c.body == body.name()) force_N += c.reaction.force_N;
  return {{"name", body.name()},
          {"force_N", length(force_N)},
          {"volume_ml", 1e6 * monitors.volume_m3},
          {"min_J", monitors.min_J},
          {"elastic_J", monitors.elastic_J},
          {"kinetic_J", monitors.kinetic_J},
          {"diverged", body.status().is_frozen}};
}

/// As viewers send it: (x, y, z, w) of the unit quaternion, w >= 0.
nlohmann::json pose_json(const Rigidd& T) {
  const Quat<double> q = quaternion_of(T.R);
  return {{"position_m", {T.t.x, T.t.y, T.t.z}}, {"quaternion", {q.x, q.y, q.z, q.w}}};
}

}  // namespace

void RunStatus::add_times(const Timings& timings) {
  for (Stage& stage : stages_) {
    const double ms = timings.last_ms(stage.name);
    if (stage.ms.size() < kFrames)
      stage.ms.push_back(ms);
    else
      stage.ms[stage.next] = ms;
    stage.next = (stage.next + 1) % kFrames;
  }
}

void RunStatus::forget() {
  stages_.clear();
  text_ = nullptr;
}

std::shared_ptr<const std::string> RunStatus::look(RunFrame& frame, bool is_paused) {
  const double now = now_s();
  const bool makes = is_paused || text_ == nullptr || now - made_s_ >= kPeriod_s;
  if (makes) {
    // Stages that ran for the first time since then.
    const std::vector<std::string> names = frame.world.timings().stages();
    for (std::size_t i = stages_.size(); i < names.size(); ++i) {
      Stage& stage = stages_.emplace_back(Stage{names[i], {}, 0});
      stage.ms.reserve(kFrames);
    }
  }
  add_times(frame.world.timings());
  if (frame.report.dt_s > 0) frame_s_ = frame.report.dt_s;
  if (makes) {
    text_ = std::make_shared<const std::string>(text(frame, is_paused));
    made_s_ = now;
  }
  return text_;
}

std::string RunStatus::text(RunFrame& frame, bool has_hash) {
  World& world = frame.world;
  nlohmann::json json{{"substeps", frame.report.substeps}, {"notices", notices_json(frame.notices)}};
  if (const double pull_N = length(frame.report.grab_N); pull_N > 0) json["pull_N"] = pull_N;
  if (const double s = budget_s_ > 0 ? budget_s_ : frame_s_; s > 0) json["budget_ms"] = 1e3 * s;
  if (has_hash) json["state_hash"] = state_hash(world);
  if (frames_in_all_) json["frames_in_all"] = *frames_in_all_;
  json["stages"] = nlohmann::json::array();
  for (const Stage& stage : stages_)
    json["stages"].push_back({{"name", stage.name},
                              {"last_ms", world.timings().last_ms(stage.name)},
                              {"p50_ms", percentile(stage.ms, 50)},
                              {"p99_ms", percentile(stage.ms, 99)}});
  const std::vector<BodyMonitors> monitors = world.monitors();
  json["bodies"] = nlohmann::json::array();
  for (std::size_t b = 0; b < monitors.size(); ++b)
    json["bodies"].push_back(body_json(*world.impl().bodies()[b], monitors[b], frame.report));
  for (const SceneParameter& p : world.parameters().of(ParameterEffect::next_frame))
    json["parameters"][p.name] = p.value;
  for (const std::string& name : held_) json["poses"][name] = pose_json(world.pose(name));
  if (world.impl().liquid() != nullptr) json["liquid"] = {{"particles", frame.report.liquid.here}};
  return json_text(json);
}

}  // namespace tactus
