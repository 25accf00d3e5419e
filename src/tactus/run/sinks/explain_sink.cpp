#include "tactus/run/sinks/explain_sink.h"
#include "tactus/sim/body/body_measures.h"
#include "tactus/sim/body/body_places.h"
#include "tactus/sim/body/body_steps.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/world/world_impl.h"

#include <cstdio>

namespace tactus {
namespace {

/// Waves so much faster than at rest are bad strain, as kBadVolume is.
constexpr double kBadSpeed = 1.5;

template <class... Values>
std::string printed(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string in_parentheses(const std::string& text) { return text.empty() ? "" : " (" + text + ")"; }

}  // namespace

template <class Text>
void ExplainSink::note(const std::string& key, std::int64_t tick, double badness, Text&& text) {
  const auto [place, is_new] = open_.try_emplace(key);
  Stretch& stretch = place->second;
  if (is_new) stretch.first = tick;
  stretch.last = tick;
  if (!is_new && badness <= stretch.worst) return;
  stretch.worst = badness;
  stretch.worst_tick = tick;
  stretch.text = text();
}

void ExplainSink::note_body(const StepReport& report, SoftBody& body, ExecContext& ctx, std::int64_t tick) {
  const std::string head = "body '" + body.name() + "': ";
  const auto where = [&](Index cube) {
    return body.places().cube_text(cube) +
           in_parentheses(body.places().acting_near(body.places().cube_center_m(cube)));
  };
  const auto depth_m = static_cast<double>(report.contact.max_depth_m);
  const std::string pressed = depth_m > 0 ? printed("; contact moved a node by up to %.4g m", depth_m) : "";
  const BodyMonitors monitors = body.measures().monitors(ctx);
  if (monitors.inverted_cubes > 0 || monitors.min_J < kBadVolume) {
    note(head + "volume", tick, 1 - monitors.min_J, [&] {
      return head +
             printed("%d cubes inverted, least volume %.3g of that at rest in ", monitors.inverted_cubes,
                     monitors.min_J) +
             where(monitors.min_J_cube) + pressed;
    });
  }
  const auto ratio = static_cast<double>(body.status().strain.speed_ratio);
  if (ratio > kBadSpeed) {
    note(head + "waves", tick, ratio, [&] {
      const auto dt = static_cast<float>(report.dt_s);
      const std::string cost = substeps_are_given_
                                   ? printed(": it asks for %d substeps, 'frame.substeps' is %d",
                                             body.steps().substeps_for(dt), report.substeps)
                                   : printed(": %d substeps instead of %d", body.steps().substeps_for(dt),
                                             body.tissue().model().substeps_for(dt));
      return head + printed("waves are %.3g times as fast as at rest in ", ratio) +
             where(body.status().strain.fastest_cube) + cost;
    });
  }
  const auto fastest = static_cast<double>(body.status().fastest_m_s());
  if (fastest > body.steps().wave_m_s()) {
    note(head + "nodes", tick, fastest, [&] {
      const Index node = body.status().node_check.fastest_node;
      return head + body.places().node_text(node) +
             printed(" went at %.3g m/s, faster than waves, %.3g m/s", fastest, body.steps().wave_m_s()) +
             in_parentheses(body.places().acting_near(body.shape().lattice.rest_m(node)));
    });
  }
}

void ExplainSink::frame(RunFrame& frame) {
  const StepReport& report = frame.report;
  const std::int64_t tick = frame.images.tick;
  for (const auto& body : frame.world.impl().bodies()) {
    if (!body->status().is_frozen) note_body(report, *body, frame.world.impl().context(), tick);
  }
  for (const Notice& notice : report.notices)
    note(notice.message(), tick, 0, [&] { return notice.message(); });
  for (auto it = open_.begin(); it != open_.end();) {
    if (it->second.last == tick) {
      ++it;
      continue;
    }
    print(it->second);
    it = open_.erase(it);
  }
}

void ExplainSink::end(RunNotices& /*notices*/) {
  for (const auto& [key, stretch] : open_) print(stretch);
  open_.clear();
}

void ExplainSink::print(const Stretch& s) {
  const auto number = [](std::int64_t tick) { return std::to_string(tick); };
  std::string when = "frame " + number(s.first);
  if (s.last > s.first) when = "frames " + number(s.first) + " to " + number(s.last);
  if (s.last > s.first && s.worst > 0) when += ", worst in " + number(s.worst_tick);
  std::printf("%s: %s\n", when.c_str(), s.text.c_str());
}

}  // namespace tactus
