#include "tactus/run/sinks/report_sink.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/world/world_impl.h"

#include <algorithm>

namespace tactus {
namespace {

nlohmann::json vector_json(Vec3f v) { return {v.x, v.y, v.z}; }

/// Contacts of a body in one frame, point by point.
nlohmann::json points_json(const std::vector<BodyPointContact>& contacts) {
  nlohmann::json all = nlohmann::json::array();
  for (const BodyPointContact& c : contacts) {
    nlohmann::json& item = all.emplace_back(nlohmann::json{
        {"other", c.other}, {"kind", kind_text(c.kind)}, {"impulse_N_s", vector_json(c.impulse_N_s)}});
    if (c.point < 0) continue;  // only a sum
    item.update({{"point", c.point},
                 {"point_m", vector_json(c.point_m)},
                 {"normal", vector_json(c.normal)},
                 {"gap_m", c.gap_m},
                 {"normal_N_s", c.normal_N_s},
                 {"tangential_N_s", vector_json(c.tangential_N_s)},
                 {"state", state_text(c.state)}});
  }
  return all;
}

/// Each monitor of a body over the frames.
nlohmann::json monitors_json(const std::vector<std::vector<BodyMonitors>>& frames, std::size_t body) {
  nlohmann::json json = nlohmann::json::object();
  for (const std::vector<BodyMonitors>& frame : frames) {
    const BodyMonitors& m = frame[body];
    json["kinetic_J"].push_back(m.kinetic_J);
    json["elastic_J"].push_back(m.elastic_J);
    json["hourglass_J"].push_back(m.hourglass_J);
    json["momentum_kg_m_s"].push_back({m.momentum_kg_m_s.x, m.momentum_kg_m_s.y, m.momentum_kg_m_s.z});
    const Vec3d turning = m.angular_momentum_kg_m2_s;
    json["angular_momentum_kg_m2_s"].push_back({turning.x, turning.y, turning.z});
    json["volume_m3"].push_back(m.volume_m3);
    json["min_J"].push_back(m.min_J);
    json["inverted_cubes"].push_back(m.inverted_cubes);
  }
  return json;
}

/// Forces and torques of prescribed motions on a body's moved regions, over the frames.
nlohmann::json motions_json(const RunSummary& summary, std::size_t body,
                            const std::vector<MovedRegion>& moved) {
  const auto over_frames = [&](Vec3d MotionForce::*vector, std::size_t m) {
    nlohmann::json all = nlohmann::json::array();
    for (const auto& frame : summary.motion_forces) {
      const Vec3d f = frame[body][m].*vector;
      all.push_back({f.x, f.y, f.z});
    }
    return all;
  };
  nlohmann::json json = nlohmann::json::array();
  for (std::size_t m = 0; m < moved.size(); ++m)
    json.push_back({{"name", moved[m].name},
                    {"force_N", over_frames(&MotionForce::force_N, m)},
                    {"torque_N_m", over_frames(&MotionForce::torque_N_m, m)}});
  return json;
}

/// Strain and stress at a probe, over the frames.
nlohmann::json strains_json(const RunSummary& summary, std::size_t probe) {
  const auto components = [](const Mat3d& m) {
    return nlohmann::json{m(0, 0), m(1, 1), m(2, 2), m(1, 2), m(2, 0), m(0, 1)};
  };
  nlohmann::json json;
  for (const char* key : {"green_strain", "cauchy_stress_Pa", "von_mises_Pa"})
    json[key] = nlohmann::json::array();
  for (const std::vector<ProbeReading>& frame : summary.probes) {
    const CubeStrain& of = frame[probe].strain;
    json["green_strain"].push_back(components(of.strain));
    json["cauchy_stress_Pa"].push_back(components(of.stress_Pa));
    json["von_mises_Pa"].push_back(of.von_mises_Pa());
  }
  return json;
}

/// Contacts and their reactions, frame by frame.
nlohmann::json contacts_json(const std::vector<std::vector<BodyContact>>& frames) {
  const auto vector = [](Vec3f v) { return nlohmann::json{v.x, v.y, v.z}; };
  nlohmann::json json = nlohmann::json::array();
  for (const std::vector<BodyContact>& frame : frames) {
    nlohmann::json of_frame = nlohmann::json::array();
    for (const BodyContact& c : frame)
      of_frame.push_back({{"body", c.body},
                          {"component", c.component},
                          {"force_N", vector(c.reaction.force_N)},
                          {"torque_N_m", vector(c.reaction.torque_N_m)},
                          {"impulse_N_s", vector(c.reaction.impulse_N_s)}});
    json.push_back(std::move(of_frame));
  }
  return json;
}

/// The ledgers of the liquid, frame by frame. Exactly: placed + emitted = here + taken + replaced; and
/// particles that films took and gave are in taken and emitted, too: (film_taken - film_given) particles =
/// film + stain.
nlohmann::json liquid_json(const RunSummary& summary, const LiquidDescription& liquid) {
  nlohmann::json json{{"particle_m3", liquid.spacing_m * liquid.spacing_m * liquid.spacing_m}};
  for (const char* key :
       {"particles", "placed", "emitted", "waiting", "taken", "replaced", "fastest_m_s", "densest"})
    json[key] = nlohmann::json::array();
  for (const LiquidReport& r : summary.liquid) {
    json["particles"].push_back(r.here);
    json["placed"].push_back(r.placed);
    json["emitted"].push_back(r.emitted);
    json["waiting"].push_back(r.waiting);
    json["taken"].push_back(r.taken);
    json["replaced"].push_back(r.replaced);
    json["fastest_m_s"].push_back(r.fastest_m_s);
    json["densest"].push_back(r.densest);
  }
  json["steps"] = summary.liquid_steps;
  json["waiting_ml"] = summary.liquid_waiting_ml;
  for (const char* key : {"film_ml", "stain_ml", "film_taken", "film_given"})
    json[key] = nlohmann::json::array();
  for (const SceneFilmReport& r : summary.films) {
    json["film_ml"].push_back(1e6 * r.film_m3);
    json["stain_ml"].push_back(1e6 * r.stain_m3);
    json["film_taken"].push_back(r.taken);
    json["film_given"].push_back(r.given);
  }
  json["forces"] = nlohmann::json::array();
  for (const std::vector<LiquidReaction>& frame : summary.liquid_forces) {
    nlohmann::json of_frame = nlohmann::json::object();
    for (const LiquidReaction& f : frame) of_frame[f.on] = {f.force_N.x, f.force_N.y, f.force_N.z};
    json["forces"].push_back(std::move(of_frame));
  }
  return json;
}

/// State, misfit, pose and covariance of tracked blades, frame by frame.
nlohmann::json blades_json(const RunSummary& summary, const Scene& scene) {
  nlohmann::json json = nlohmann::json::array();
  std::size_t tracked = 0;
  for (const BladeDescription& blade : scene.blades) {
    if (!blade.tracked) continue;
    nlohmann::json frames = nlohmann::json::array();
    for (const std::vector<TrackedBlade>& frame : summary.blades) {
      const TrackedBlade& now = frame.at(tracked);
      nlohmann::json one{{"state", blade_state_name(now.state)}};
      if (now.state != BladeState::absent) {
        one["misfit_px"] = now.misfit_px;
        one["edge_covered"] = now.edge_covered;
        one["residual_px"] = now.residual_px;
      }
      if (now.state > BladeState::ambiguous) {
        const Rigidd& T = now.T_world_model;
        one["position_m"] = {T.t.x, T.t.y, T.t.z};
        for (int i = 0; i < 3; ++i) one["rotation"].push_back({T.R(i, 0), T.R(i, 1), T.R(i, 2)});
        one["two_sigma_m"] = now.two_sigma_m;
        for (int i = 0; i < 6; ++i) {
          nlohmann::json row = nlohmann::json::array();
          for (int k = 0; k < 6; ++k) row.push_back(now.covariance(i, k));
          one["covariance"].push_back(row);
        }
      }
      frames.push_back(std::move(one));
    }
    json.push_back({{"name", blade.name}, {"poses", std::move(frames)}});
    ++tracked;
  }
  return json;
}

/// The score of a stroke.
nlohmann::json stroke_json(const StrokeResult& stroke) {
  const CutScore& c = stroke.score;
  nlohmann::json json{{"blade", c.blade},
                      {"body", c.body},
                      {"path_m", c.path_m},
                      {"depth_m", c.depth_m},
                      {"area_m2", c.area_m2},
                      {"skin_length_m", stroke.skin_length_m},
                      {"begin_s", c.begin_s},
                      {"end_s", c.end_s},
                      {"time_s", c.end_s - c.begin_s},
                      {"cut_cubes", c.cut_cubes},
                      {"slivers", c.slivers},
                      {"blood_ml", 1e6 * c.bled_m3},
                      {"waiting_ml", 1e6 * (c.due_m3 - c.bled_m3)}};
  if (stroke.peak_force_N) json["peak_force_N"] = *stroke.peak_force_N;
  if (!stroke.deviation) return json;
  json["plan"] = stroke.plan;
  json["deviation_mean_m"] = stroke.deviation->mean_m;
  json["deviation_max_m"] = stroke.deviation->max_m;
  json["followed_m"] = stroke.deviation->followed_m;
  json["beyond_m"] = stroke.deviation->beyond_m;
  return json;
}

}  // namespace

void RunSummary::add(const StepReport& report) {
  substeps = std::max(substeps, report.substeps);
  settling_substeps += report.settling_substeps;
  max_vertices = std::max(max_vertices, report.hull.vertices);
  max_triangles = std::max(max_triangles, report.hull.triangles);
  pushed_out += report.contact.pushed_out;
  max_force_N = std::max(max_force_N, static_cast<double>(length(report.contact.force_N)));
  max_correction_m = std::max(max_correction_m, static_cast<double>(report.contact.max_depth_m));
  liquid.push_back(report.liquid);
  liquid_steps.push_back(report.liquid_steps);
  liquid_waiting_ml.push_back(1e6 * report.liquid_waiting_m3);
  films.push_back(report.film);
  liquid_forces.push_back(report.liquid_forces);
  contacts.push_back(report.contacts);
}

void ReportSink::frame(RunFrame& frame) {
  World& world = frame.world;
  summary_.add(frame.report);
  for (const std::string& body : contacts_of_)
    points_[body].push_back(points_json(frame.world.contacts(body)));
  summary_.probes.push_back(world.probes());
  summary_.monitors.push_back(world.monitors());
  if (const Perception* seen = world.perception())
    summary_.blades.push_back(seen->impl().tracked_blades().now());
  summary_.motion_forces.push_back(world.motion_forces());
}

nlohmann::json ReportSink::to_json(const FrameLoop& loop, World& world, const std::string& devices) const {
  const RunSummary& summary = summary_;
  nlohmann::json json{{"scene", scene_.name}, {"devices", devices}, {"frames", loop.frames()}};
  for (const std::string& stage : world.timings().stages()) {
    json["ms"][stage] = {{"p50", world.timings().percentile_ms(stage, 50)},
                         {"p99", world.timings().percentile_ms(stage, 99)}};
  }
  json["counters"] = {
      {"bad_frames", loop.bad_frames()},       {"open_frames", loop.open_frames()},
      {"substeps", summary.substeps},          {"settling_substeps", summary.settling_substeps},
      {"max_vertices", summary.max_vertices},  {"max_triangles", summary.max_triangles},
      {"pushed_out_nodes", summary.pushed_out}};
  for (std::size_t b = 0; b < world.impl().bodies().size(); ++b) {
    const SoftBody& body = *world.impl().bodies()[b];
    json["bodies"].push_back({{"name", body.name()},
                              {"nodes", nodes_in_use(body.shape().lattice)},
                              {"contact_points", body.points().count()},
                              {"devices", body.tissue().slab_count()},
                              {"monitors", monitors_json(summary.monitors, b)},
                              {"moved", motions_json(summary, b, scene_.bodies[b].moved)}});
    if (const auto points = points_.find(body.name()); points != points_.end())
      json["bodies"][b]["contacts"] = points->second;
  }
  for (std::size_t b = 0; b < world.impl().bodies().size(); ++b) {
    if (world.impl().bodies()[b]->cuts() == nullptr) continue;
    const BodyCuts::State state = world.impl().bodies()[b]->cuts()->state(world.impl().context());
    json["bodies"][b]["cut"] = {
        {"parts", state.parts}, {"copies", state.copies}, {"closed_volumes_m3", state.closed_volumes_m3}};
  }
  for (const StrokeResult& stroke : world.stroke_results()) json["cuts"].push_back(stroke_json(stroke));
  json["monitors"] = {{"max_force_N", summary.max_force_N}, {"max_correction_m", summary.max_correction_m}};
  json["statuses"] = loop.notices().statuses();
  json["contacts"] = contacts_json(summary.contacts);
  if (!summary.blades.empty() && !summary.blades.front().empty())
    json["blades"] = blades_json(summary, scene_);
  if (scene_.fluid) json["liquid"] = liquid_json(summary, *scene_.fluid);
  json["recordings"] = world.impl().schedule().recordings();
  json["notices"] = nlohmann::json::array();
  for (const Notice& n : loop.notices().notices())
    json["notices"].push_back(
        {{"code", n.code}, {"severity", severity_text(n.severity)}, {"text", n.text}, {"remedy", n.remedy}});
  for (std::size_t p = 0; p < scene_.probes.size(); ++p) {
    nlohmann::json track = nlohmann::json::array();
    for (const std::vector<ProbeReading>& frame : summary.probes) {
      const Vec3f at_m = frame[p].position_m;
      track.push_back({at_m.x, at_m.y, at_m.z});
    }
    json["probes"][scene_.probes[p].name] = track;
    json["probe_strains"][scene_.probes[p].name] = strains_json(summary, p);
  }
  return json;
}

}  // namespace tactus
