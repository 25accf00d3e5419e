// Cuts of bodies by blades between two frames.
#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/sim/body/cut_capacity.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

/// A blade that jumps is a mistake, not a stroke [m].
constexpr float kLongestStrip_m = 0.2F;

Notice full_notice(const std::string& who, const SoftBody& body) {
  constexpr int kStrokes = 50;
  return {"cut.full", Severity::warning,
          who + ": there is no capacity for more copies of cubes than the " +
              std::to_string(body.cuts()->cutter().lattice().copies_in_use()) +
              " that it has; the rest is not cut",
          "raise 'cut_capacity' of the body, or leave it out, so that capacity grows: " +
              std::to_string(copies_of_strokes(body.shape().lattice.regular_cubes(), kStrokes)) + " hold " +
              std::to_string(kStrokes) + " straight strokes through all of it"};
}

/// Whether it is known why a blade doesn't cut: it jumped, was refused, or found no capacity.
bool is_told(const std::string& blade, const std::set<std::string>& reported,
             const std::map<std::string, double>& full_s) {
  const auto is_of_blade = [&](const std::string& told) {
    return told == blade + "jumps" || told.starts_with("blade '" + blade + "' in body '");
  };
  return std::any_of(reported.begin(), reported.end(), is_of_blade) ||
         std::any_of(full_s.begin(), full_s.end(), [&](const auto& full) { return is_of_blade(full.first); });
}

Notice missed_notice(const BladeDescription& blade) {
  return {"cut.missed", Severity::warning,
          "blade '" + blade.name + "' is at the end of its path and has cut nothing",
          "compare 'from_m', 'to_m' and 'path' of the blade, metres in the world, with where the body is "
          "then"};
}

/// Way of the middle of the edge.
double displacement_m(const cut::BladeStrip& strip) {
  Vec3f sum{};
  for (std::size_t k = 0; k < strip.begin_m.size(); ++k) sum += strip.end_m[k] - strip.begin_m[k];
  return static_cast<double>(length(sum)) / static_cast<double>(strip.begin_m.size());
}

float length_of(const cut::BladeStrip& strip) {
  float longest_m = 0;
  for (std::size_t k = 0; k < strip.begin_m.size(); ++k)
    longest_m = std::max(longest_m, length(strip.end_m[k] - strip.begin_m[k]));
  return longest_m;
}

}  // namespace

cut::BladeStrip World::Impl::strip_of(std::size_t b, double from_s, double to_s) const {
  const BladeDescription& blade = scene_.blades[b];
  if (blade.tracked) return seen_strip(b);
  return blade.held ? held_blades_.strip(blade.name, cut_frame_) : swept(blade, from_s, to_s, cut_frame_);
}

void World::Impl::cut_bodies(double from_s, double to_s, StepReport& report) {
  if (scene_.blades.empty() || !(to_s > from_s)) return;
  const StageTimer timer(timings_, "cut");
  ++cut_frame_;
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    SoftBody& body = *bodies_[k];
    if (body.cuts() == nullptr || body.status().is_frozen) continue;
    bool has_changed = false;
    for (std::size_t b = 0; b < scene_.blades.size(); ++b) {
      const BladeDescription& blade = scene_.blades[b];
      const cut::BladeStrip strip = strip_of(b, from_s, to_s);
      if (strip.begin_m.empty()) continue;
      if (const float displacement_m = length_of(strip); displacement_m > kLongestStrip_m) {
        if (reported_cuts_.insert(blade.name + "jumps").second)
          report.notices.push_back({"cut.jump", Severity::warning,
                                    "blade '" + blade.name + "' moves by " +
                                        number_text(double{displacement_m}, double{kLongestStrip_m}) +
                                        " m in a frame, expected at most " +
                                        number_text(double{kLongestStrip_m}) + " m; it cuts nothing there",
                                    blade.held ? "move it slower, or give frames less time ('frame.dt_s')"
                                               : "give its path more time, or frames less ('frame.dt_s')"});
        continue;
      }
      has_changed = cut_body(k, b, strip, from_s, to_s, report) || has_changed;
    }
    body.cuts()->remember_nodes();
    if (has_changed) follow_cuts(k, report.notices);
  }
  tools_.strips.clear();
  for (const BladeDescription& blade : scene_.blades) {
    if (blade.path.empty()) continue;
    // In this step or, by rounding of times, in the one before.
    const double end_s = blade.path.back().time_s;
    const bool ends = end_s <= to_s && end_s > from_s - (to_s - from_s);
    if (!ends) continue;
    const bool has_cut = std::any_of(cuts_.begin(), cuts_.end(), [&](const CutScore& score) {
      return score.blade == blade.name && score.cut_cubes > 0;
    });
    if (!has_cut && !is_told(blade.name, reported_cuts_, full_s_) &&
        reported_cuts_.insert(blade.name + "missed").second)
      report.notices.push_back(missed_notice(blade));
  }
}

bool World::Impl::cut_body(std::size_t k, std::size_t b, const cut::BladeStrip& strip, double from_s,
                           double to_s, StepReport& report) {
  const BladeDescription& blade = scene_.blades[b];
  SoftBody& body = *bodies_[k];
  const auto touch = [&](const TopologyChange& change, std::span<const PointChange> points) {
    touching_.apply(static_cast<Index>(k), body.cuts()->cutter(), change, points);
  };
  CutScore& score = stroke_of(blade.name, body.name(), from_s);
  body.cuts()->begin_stroke(score.stroke, cut_frame_);
  cut::CutReport cut = body.cuts()->cut(context(), b, strip, touch);
  while (cut.is_full && cut.cut_cubes == 0 && grow(k, true)) {
    const bool is_refused = cut.is_refused;
    body.cuts()->begin_stroke(score.stroke, cut_frame_);
    cut = body.cuts()->go_on(context(), touch);
    cut.is_refused = is_refused;
  }
  const std::string who = "blade '" + blade.name + "' in body '" + body.name() + "'";
  if (cut.is_full) report_full(who, body, from_s, report.notices);
  if (cut.is_refused && reported_cuts_.insert(who + "refused").second)
    report.notices.push_back(
        {"cut.refused", Severity::warning,
         who + " meets cubes that are moved, loaded or of shape matching; they are not cut",
         "make them elements, or lead the blade past them"});
  if (cut.cut_cubes > 0)
    add_cut(strip, cut, from_s, to_s, score);
  else if (score.cut_cubes == 0)
    cuts_.pop_back();
  else
    score.pending_m += displacement_m(strip);
  return cut.cut_cubes > 0;
}

/// One notice a stroke.
void World::Impl::report_full(const std::string& who, const SoftBody& body, double from_s,
                              std::vector<Notice>& notices) {
  const auto [known, is_first] = full_s_.try_emplace(who, from_s);
  const bool goes_on = !is_first && from_s - std::exchange(known->second, from_s) <= kStrokePause_s;
  if (!goes_on) notices.push_back(full_notice(who, body));
}

/// Lets the probes in a body, and the liquid round it, follow its cuts.
void World::Impl::follow_cuts(std::size_t number, std::vector<Notice>& notices) {
  SoftBody& body = *bodies_[number];
  if (liquid_)
    liquid_->follow_cut(body, notices);
  else
    body.cuts()->forget_wall_change();
  for (Probe& probe : probes_) {
    if (probe.body != number) continue;
    body.cuts()->follow(probe.point);
    probe.strain = strain_at_point(body.shape(), probe.point);
  }
  if (grab_ && grabbed_ == number) follow_cut_of_grab();
}

/// The last stroke of the blade in the body, or a new one, which is the last of all.
CutScore& World::Impl::stroke_of(const std::string& blade, const std::string& body, double from_s) {
  Index count = 0;
  CutScore* last = nullptr;
  for (CutScore& c : cuts_) {
    count += c.body == body ? 1 : 0;
    if (c.body == body && c.blade == blade) last = &c;
  }
  if (last != nullptr && from_s - last->end_s < kStrokePause_s) return *last;
  return cuts_.emplace_back(CutScore{.blade = blade, .body = body, .begin_s = from_s, .stroke = count});
}

void World::Impl::add_cut(const cut::BladeStrip& strip, const cut::CutReport& cut, double from_s, double to_s,
                          CutScore& score) {
  if (score.cut_cubes == 0) score.begin_s = from_s;
  score.steps.push_back({score.pending_m + displacement_m(strip), cut.area_m2});
  score.path_m += score.steps.back().displacement_m;
  score.pending_m = 0;
  score.slivers += cut.slivers;
  score.depth_m = std::max(score.depth_m, cut.depth_m);
  score.area_m2 += cut.area_m2;
  score.end_s = to_s;
  score.cut_cubes += cut.cut_cubes;
}

void World::Impl::add_plans() {
  for (const PlanDescription& plan : scene_.plans) {
    for (std::size_t b = 0; b < bodies_.size(); ++b)
      if (scene_.bodies[b].name == plan.body)
        plans_.emplace_back(plan, scene_.bodies[b], bodies_[b]->shape());
  }
}

std::vector<StrokeResult> World::Impl::stroke_results() const {
  std::vector<StrokeResult> all;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const SoftBody& body = *bodies_[b];
    std::optional<PointInMesh> skin;
    for (const CutScore& score : cuts_) {
      if (score.body != body.name()) continue;
      if (!skin) skin.emplace(body.shape().surface_m);
      StrokeResult& result = all.emplace_back();
      result.score = score;
      result.skin = skin_line(body.cuts()->walls_of(score.stroke), body.shape().lattice, *skin);
      for (const SkinSegment& s : result.skin) result.skin_length_m += length(s.to_m - s.from_m);
      if (const auto& energy = scene_.bodies[b].cut_energy_j_m2)
        result.peak_force_N = peak_cut_force_N(score.steps, *energy, body.description().spacing_m);
      for (const PlannedLine& plan : plans_) {
        if (plan.body() != body.name()) continue;
        std::vector<SkinSegment> line = result.skin;
        const auto deviation = plan.measure(line);
        if (!deviation || (result.deviation && result.deviation->mean_m <= deviation->mean_m)) continue;
        result.deviation = deviation;
        result.plan = plan.name();
        result.skin = std::move(line);
      }
    }
  }
  return all;
}

}  // namespace tactus
