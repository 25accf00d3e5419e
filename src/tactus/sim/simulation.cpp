#include "tactus/sim/simulation.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tactus/base/error.h"
#include "tactus/base/log.h"

namespace tactus {
namespace {

HullOptions hull_options(const Scene& scene, const Rig& rig) {
  HullOptions options;
  options.workspace_m = rig.workspace_m;
  options.slack_px = rig.slack_px;
  if (const auto& box = scene.reconstruction.workspace_m) {
    options.workspace_m = {vec_cast<float>(box->min_m), vec_cast<float>(box->max_m)};
  }
  options.resolution = scene.reconstruction.resolution;
  options.depth_jump_m = static_cast<float>(scene.reconstruction.depth_jump_m);
  options.tolerated_views = scene.reconstruction.tolerated_views;
  options.min_views = scene.reconstruction.min_views;
  options.max_active_bricks = scene.reconstruction.max_active_bricks;
  options.max_vertices = scene.reconstruction.max_vertices;
  options.max_triangles = scene.reconstruction.max_triangles;
  return options;
}

std::span<const Camera> depth_cameras(const Scene& scene, const Rig& rig) {
  if (!scene.reconstruction.depth) return {};
  return rig.depth_cameras;
}

float sample_spacing_m(const Scene& scene, const VisualHull& hull) {
  if (scene.contact.sample_spacing_m) return static_cast<float>(*scene.contact.sample_spacing_m);
  double spacing =
      scene.bodies.empty() ? 2 * static_cast<double>(hull.voxel_size_m()) : scene.bodies.front().spacing_m;
  for (const BodyDescription& body : scene.bodies) spacing = std::min(spacing, body.spacing_m);
  return static_cast<float>(spacing);
}

std::string vec_text(Vec3d v) {
  const auto text = [](double x) { return number_text(std::round(x * 1e6) / 1e6 + 0.0); };
  return "[" + text(v.x) + ", " + text(v.y) + ", " + text(v.z) + "]";
}

RealSurfaceSettings surface_settings(const DeviceMesh& mesh, float spacing_m) {
  RealSurfaceSettings settings;
  settings.sample_spacing_m = spacing_m;
  settings.max_vertices = mesh.positions_m.size();
  settings.max_triangles = mesh.triangles.size();
  settings.max_raw_samples = std::max(settings.max_raw_samples, 2 * mesh.triangles.size());
  return settings;
}

}  // namespace

Simulation::Simulation(DeviceSet& devices, const Scene& scene, const Rig& rig, const BodyAssets& assets)
    : devices_(devices),
      scene_(scene),
      hull_(devices, rig.cameras, hull_options(scene, rig), depth_cameras(scene, rig)),
      hull_check_(devices.context(0), rig.cameras, hull_options(scene, rig).workspace_m,
                  hull_.voxel_size_m()),
      normals_(devices.device(0), hull_.mesh().positions_m.size()),
      uses_depth_(!depth_cameras(scene, rig).empty()),
      sample_spacing_m_(sample_spacing_m(scene, hull_)),
      surface_(devices.device(0), surface_settings(hull_.mesh(), sample_spacing_m_)),
      bodies_([&] {
        std::vector<std::unique_ptr<SoftBody>> bodies;
        for (const BodyDescription& body : scene.bodies) {
          bodies.push_back(std::make_unique<SoftBody>(devices, body, assets, sample_spacing_m_));
        }
        return bodies;
      }()),
      contact_(devices.device(0),
               [&] {
                 Index nodes = 0;
                 for (const auto& body : bodies_) {
                   body->set_first_record(nodes);
                   nodes += body->contact_node_count();
                 }
                 return nodes;
               }(),
               {.restitution = static_cast<float>(scene.contact.restitution),
                .friction = static_cast<float>(scene.contact.friction)}),
      timings_(scene.output.trace) {
  if (scene.reconstruction.repair_masks)
    view_scores_.emplace(devices.context(0), rig.cameras,
                         ViewScoreOptions{.workspace_m = hull_options(scene, rig).workspace_m});
  for (const ProbeDescription& probe : scene.probes) add_probe(probe);
  for (const BodyDescription& body : scene.bodies) {
    if (body.fixed.empty() && body.moved.empty() && dot(scene.gravity_m_s2, scene.gravity_m_s2) > 0)
      log_warning("body '" + body.name + "': gravity pulls and nothing is 'fixed': it will fall");
  }
  for (auto& body : bodies_) body->update_surface(devices.context(0));
  devices_.synchronize();
}

void Simulation::add_probe(const ProbeDescription& probe) {
  const auto body = std::find_if(scene_.bodies.begin(), scene_.bodies.end(),
                                 [&](const BodyDescription& b) { return b.name == probe.body; });
  if (body == scene_.bodies.end())
    throw usage_error("probe '" + probe.name + "': there is no body '" + probe.body + "'");
  const auto index = static_cast<std::size_t>(body - scene_.bodies.begin());
  const bool in_body = probe.frame == CoordinateFrame::body;
  const Vec3d at_m = in_body ? body->placement.to_world(probe.position_m) : probe.position_m;
  const EmbeddedPoint embedded =
      embed_point(bodies_[index]->shape(), body->shape.fill, vec_cast<float>(at_m));
  if (embedded.outside) {
    const Vec3d nearest_m = vec_cast<double>(embedded.outside->nearest_m);
    throw usage_error("probe '" + probe.name + "': position_m " + vec_text(probe.position_m) + " lies " +
                      number_text(static_cast<double>(embedded.outside->distance_m)) + " m outside body '" +
                      probe.body + "'; the nearest point of its surface is " +
                      vec_text(in_body ? body->placement.to_body(nearest_m) : nearest_m) +
                      " (frame: " + (in_body ? "body" : "world") + ")");
  }
  probes_.push_back({index, embedded.point});
}

StepReport Simulation::step(const FrameSet& frame, double dt_s) {
  const StageTimer whole(timings_, "frame");
  StepReport report;
  report.dt_s = scene_.frame.dt_s.value_or(dt_s);
  reconstruct(frame, report);
  last_dt_s_ = report.dt_s;
  touch(report.dt_s, report);
  report.hull = hull_.report();
  if (const auto& overflow = report.hull.overflow; overflow && report.status.empty())
    report.status = overflow->text("reconstruction." + overflow->option);
  if (report.status.empty()) report.status = report.hull.depth;
  if (const std::string news = hull_check_.tell(devices_.context(0)); report.status.empty())
    report.status = news;
  const RealSurfaceReport surface = surface_.report(devices_.context(0));
  if (report.status.empty() && surface.dropped_raw_samples + surface.dropped_samples > 0) {
    report.status = std::to_string(surface.dropped_raw_samples + surface.dropped_samples) +
                    " samples of the real surface were dropped: raise contact.sample_spacing_m";
  }
  return report;
}

std::span<const DepthImage> Simulation::depths(const FrameSet& frame) const {
  if (!uses_depth_) return {};
  return frame.depths_m;
}

std::span<const BitMask> Simulation::silhouettes(const FrameSet& frame, std::string& status) {
  if (!view_scores_) return frame.silhouettes;
  const StageTimer timer(timings_, "views");
  ExecContext& ctx = devices_.context(0);
  const std::vector<ViewScore> found = view_scores_->measure(ctx, frame.silhouettes);
  repaired_ = frame.silhouettes;
  const std::vector<RepairedMask> repairs = repair_masks(ctx, *view_scores_, found, repaired_);
  status = suspect_views_text(view_scores_->cameras(), found);
  if (!repairs.empty()) status += "; " + repairs_text(view_scores_->cameras(), repairs);
  return repaired_;
}

void Simulation::reconstruct(const FrameSet& frame, StepReport& report) {
  const std::span<const BitMask> masks = silhouettes(frame, report.status);
  const auto stage = [&](const char* name, auto&& body) {
    const StageTimer timer(timings_, name);
    body();
    devices_.synchronize();  // stage times are part of the report
  };
  stage("upload", [&] { hull_.upload(masks, depths(frame)); });
  stage("hull", [&] { hull_.carve(); });
  stage("mesh", [&] { hull_.extract(); });
  stage("check", [&] { hull_check_.submit(devices_.context(0), hull_.mesh(), frame.silhouettes); });
}

void Simulation::touch(double dt_s, StepReport& report) {
  ExecContext& ctx = devices_.context(0);
  const auto dt = static_cast<float>(dt_s);
  const DeviceMesh mesh = hull_.mesh();
  {
    const StageTimer timer(timings_, "surface");
    surface_replay_.run(ctx, dt, [&] {
      surface_.update(ctx, {mesh.positions_m, mesh.vertex_count(), {}, mesh.triangles, mesh.triangle_count()},
                      dt);
    });
    ctx.synchronize();
  }
  if (dt > 0) {
    const StageTimer timer(timings_, "bodies");
    const SubstepPlan plan = plan_substeps(dt);
    for (auto& body : bodies_) body->check_substeps(dt, plan.count);
    substep_replay_.run(ctx, plan, [&] { run_substeps(ctx, plan); });
    for (auto& body : bodies_)
      body->step_frame_on_all(dt / static_cast<float>(plan.count), vec_cast<float>(scene_.gravity_m_s2),
                              plan.count);
    for (auto& body : bodies_) {
      const std::string trouble = body->end_frame(ctx, plan.count);
      if (!trouble.empty()) report.status = trouble;
    }
    report.substeps = plan.count;
    report.contact = contact_.report(ctx, dt, plan.count);
  }
  const StageTimer timer(timings_, "embed");
  for (auto& body : bodies_) body->update_surface(ctx);
  ctx.synchronize();
}

Simulation::SubstepPlan Simulation::plan_substeps(float dt_s) const {
  SubstepPlan plan{.dt_s = dt_s, .count = scene_.frame.substeps.value_or(1)};
  int multiple = 1;
  for (const auto& body : bodies_) {
    if (!scene_.frame.substeps) plan.count = std::max(plan.count, body->substeps_for(dt_s));
    plan.resting_bodies += body->at_rest() ? 1 : 0;
    multiple = std::lcm(multiple, body->matching_every());
  }
  if (!scene_.frame.substeps) plan.count = ceil_div(plan.count, multiple) * multiple;
  return plan;
}

/// Without the host: what is recorded is replayed as one graph.
void Simulation::run_substeps(ExecContext& ctx, const SubstepPlan& plan) {
  const float dt_substep = plan.dt_s / static_cast<float>(plan.count);
  // The frame ends on the surface that was measured: its samples come from where it was a frame ago.
  contact_.begin_frame(ctx, {.dt_s = dt_substep, .substeps = plan.count, .dt_frame_s = plan.dt_s});
  for (auto& body : bodies_) body->begin_frame(ctx);
  const auto gravity_m_s2 = vec_cast<float>(scene_.gravity_m_s2);
  for (auto& body : bodies_) {
    if (body->contact_node_count() > 0) contact_.rescue(ctx, surface_, body->contact_nodes());
    if (body->is_untouched()) body->step_frame(dt_substep, gravity_m_s2, plan.count);
  }
  for (int k = 0; k < plan.count; ++k) {
    for (auto& body : bodies_) {
      if (body->is_untouched()) continue;
      body->step(dt_substep, gravity_m_s2, k);
      if (body->contact_node_count() > 0) body->touch(ctx, contact_, surface_, k);
      body->watch(k, plan.count);
    }
  }
  contact_.end_frame(ctx);
}

FrameSnapshot Simulation::snapshot() {
  FrameSnapshot snapshot;
  snapshot.real = hull_.download();
  ExecContext& ctx = devices_.context(0);
  normals_.compute(ctx, hull_.mesh(), hull_.voxel_size_m());
  snapshot.real.normals =
      to_host(ctx, normals_.view().part(0, static_cast<Index>(snapshot.real.positions_m.size())));
  for (const auto& body : bodies_) {
    snapshot.bodies.push_back(body->surface(devices_.context(0)));
  }
  return snapshot;
}

std::vector<BodyMonitors> Simulation::monitors() {
  std::vector<BodyMonitors> all;
  for (const auto& body : bodies_) all.push_back(body->monitors(devices_.context(0)));
  return all;
}

std::vector<std::vector<Vec3d>> Simulation::motion_forces_N() {
  std::vector<std::vector<Vec3d>> all;
  for (const auto& body : bodies_) all.push_back(body->motion_forces_N(last_dt_s_));
  return all;
}

std::vector<Vec3f> Simulation::probe_positions_m() {
  std::vector<Vec3f> positions;
  std::vector<std::vector<Vec3f>> nodes_m(bodies_.size());  // of bodies with probes, each once
  for (const Probe& probe : probes_) {
    std::vector<Vec3f>& x_m = nodes_m[probe.body];
    if (x_m.empty()) x_m = bodies_[probe.body]->positions_m(devices_.context(0));
    positions.push_back(probe.point.position_m(x_m));
  }
  return positions;
}

}  // namespace tactus
