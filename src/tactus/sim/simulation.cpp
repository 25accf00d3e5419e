#include "tactus/sim/simulation.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/sim/start_check.h"

namespace tactus {
namespace {

/// Without cameras no image ever comes, and the reconstruction is as small as can be.
std::vector<Camera> cameras_or_one(const Rig& rig) {
  if (!rig.cameras.empty()) return rig.cameras;
  return {look_at({0, 0, 1}, {}, {0, 1, 0}, 8, 8, 8)};
}

HullOptions hull_options(const Scene& scene, const Rig& rig) {
  HullOptions options;
  if (rig.cameras.empty()) {
    options.workspace_m = {{-0.1F, -0.1F, -0.1F}, {0.1F, 0.1F, 0.1F}};
    options.resolution = 4;
    return options;
  }
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
  // Contact's samples before thinning, two for each triangle of which a vertex has two: about 150 bytes each.
  options.beside_vertex_bytes = 600;
  return options;
}

/// With voxels twice as large.
HullOptions coarse(HullOptions options) {
  options.resolution = ceil_div(options.resolution, 2);
  return options;
}

std::vector<std::string> names_of(const std::vector<BodyDescription>& bodies) {
  std::vector<std::string> names;
  for (const BodyDescription& body : bodies) names.push_back(body.name);
  return names;
}

std::span<const Camera> depth_cameras(const Scene& scene, const Rig& rig) {
  if (!scene.reconstruction.depth) return {};
  return rig.depth_cameras;
}

float sample_spacing_m(const Scene& scene, float voxel_size_m) {
  if (scene.contact.sample_spacing_m) return static_cast<float>(*scene.contact.sample_spacing_m);
  double spacing =
      scene.bodies.empty() ? 2 * static_cast<double>(voxel_size_m) : scene.bodies.front().spacing_m;
  for (const BodyDescription& body : scene.bodies) spacing = std::min(spacing, body.spacing_m);
  return static_cast<float>(spacing);
}

RealSurfaceSettings surface_settings(const MeshView& mesh, float spacing_m) {
  RealSurfaceSettings settings;
  settings.sample_spacing_m = spacing_m;
  settings.max_vertices = mesh.positions_m.size();
  settings.max_triangles = mesh.triangles.size();
  settings.max_raw_samples = std::max(settings.max_raw_samples, 2 * mesh.triangles.size());
  return settings;
}

/// Such bodies are on the first device.
bool touches_bodies(const Scene& scene, const BodyDescription& body) {
  const auto count = std::count_if(scene.bodies.begin(), scene.bodies.end(),
                                   [](const BodyDescription& b) { return b.contact; });
  return body.contact &&
         (scene.fluid || touches_itself(scene.contact, body.cuttable) || (scene.contact.bodies && count > 1));
}

/// The first so many, as bodies that may be touched take them.
int devices_that_touch(const std::vector<std::unique_ptr<SoftBody>>& bodies) {
  int count = 1;
  for (const auto& body : bodies)
    if (!body->is_untouched()) count = std::max(count, body->device_count());
  return count;
}

void add(ColliderReaction& sum, const ColliderReaction& r) {
  sum.force_N += r.force_N;
  sum.torque_N_m += r.torque_N_m;
  sum.impulse_N_s += r.impulse_N_s;
  sum.max_depth_m = std::max(sum.max_depth_m, r.max_depth_m);
  sum.contacts += r.contacts;
}

}  // namespace

Simulation::Simulation(DeviceSet& devices, const Scene& scene, const Rig& rig, const BodyAssets& assets,
                       bool can_save)
    : devices_(devices),
      scene_(scene),
      is_filmed_(!rig.cameras.empty()),
      fine_surface_(devices, cameras_or_one(rig), depth_cameras(scene, rig),
                    {.hull = hull_options(scene, rig), .smoothing_steps = scene.reconstruction.smooth}),
      coarse_surface_(can_save ? std::make_unique<SurfacePipeline>(
                                     devices, cameras_or_one(rig), depth_cameras(scene, rig),
                                     SurfaceOptions{.hull = coarse(hull_options(scene, rig)),
                                                    .smoothing_steps = scene.reconstruction.smooth})
                               : nullptr),
      hull_check_(devices.context(0), cameras_or_one(rig), hull_options(scene, rig).workspace_m,
                  fine_surface_.voxel_size_m(), !depth_cameras(scene, rig).empty()),
      uses_depth_(!depth_cameras(scene, rig).empty()),
      sample_spacing_m_(sample_spacing_m(scene, fine_surface_.voxel_size_m())),
      bodies_([&] {
        std::vector<std::unique_ptr<SoftBody>> bodies;
        for (const BodyDescription& body : scene.bodies)
          bodies.push_back(std::make_unique<SoftBody>(devices, body, assets, touches_bodies(scene, body)));
        return bodies;
      }()),
      tracked_blades_(scene, assets, rig),
      moving_obstacles_(scene, obstacle_descriptions(scene, assets)),
      obstacle_watch_(still_ones(obstacle_descriptions(scene, assets))),
      energy_watch_(make_energy_watch()),
      contact_log_(names_of(scene.bodies)),
      world_(devices, std::max(devices_that_touch(bodies_), SceneLiquid::part_count(devices, scene)),
             surface_settings(fine_surface_.surface(), sample_spacing_m_),
             {.restitution = static_cast<float>(scene.contact.restitution),
              .friction = static_cast<float>(scene.contact.friction),
              .response = scene.contact.response},
             tracked_blades_.after(obstacle_descriptions(scene, assets))),
      touching_(devices.context(0), bodies_, scene.contact, scene.frame),
      readback_(devices),
      schedule_(devices),
      clock_(scene.frame.max_dt_s, scene.frame.dt_s),
      is_settled_(scene.frame.start == FrameStart::undeformed),
      timings_(scene.output.trace) {
  check_settles();
  if (scene.reconstruction.repair_masks && is_filmed_)
    view_scores_.emplace(devices.context(0), rig.cameras,
                         ViewScoreOptions{.workspace_m = hull_options(scene, rig).workspace_m});
  for (const ProbeDescription& probe : scene.probes) add_probe(probe);
  add_plans();
  for (const BodyDescription& body : scene.bodies) {
    if (body.fixed.empty() && body.moved.empty() && scene.obstacles.empty() &&
        dot(scene.gravity_m_s2, scene.gravity_m_s2) > 0)
      log_warning("body '" + body.name + "': gravity pulls and nothing is 'fixed': it will fall");
  }
  start_notices_ = overlaps_at_start(scene, bodies_, still_ones(obstacle_descriptions(scene, assets)));
  if (is_filmed_) report_far_bodies(scene, bodies_, hull_options(scene, rig).workspace_m, start_notices_);
  if (scene.fluid)
    liquid_ = std::make_unique<SceneLiquid>(devices, scene, bodies_,
                                            still_ones(obstacle_descriptions(scene, assets)));
  add_stages();
  schedule_.close();
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
  const PointInBody embedded = place_point(bodies_[index]->shape(), body->shape.fill, vec_cast<float>(at_m));
  if (embedded.outside) {
    const Vec3d nearest_m = vec_cast<double>(embedded.outside->nearest_m);
    throw usage_error("probe '" + probe.name + "': position_m " + point_text(probe.position_m) + " lies " +
                      number_text(static_cast<double>(embedded.outside->distance_m)) + " m outside body '" +
                      probe.body + "'; the nearest point of its surface is " +
                      point_text(in_body ? body->placement.to_body(nearest_m) : nearest_m) +
                      " (frame: " + (in_body ? "body" : "world") + ")");
  }
  probes_.push_back({index, embedded.point, strain_at_point(bodies_[index]->shape(), embedded.point)});
}

void Simulation::add_stages() {
  const StageDevices touching = world_.count() > 1 ? StageDevices::all : StageDevices::first;
  add_surface_stages(touching);
  schedule_.add({.name = "contact/begin",
                 .timed_as = "begin",
                 .rate = Rate::before,
                 .devices = touching,
                 .writes = {"contact/poses"},
                 .submit = [this](BlockPlace) { world_.begin_frame(schedule_.frame()); }});
  for (auto& body : bodies_)
    body->add_stages(schedule_, readback_, world_, vec_cast<float>(scene_.gravity_m_s2));
  touching_.add_stages(schedule_, readback_, world_.part(0).contact);
  if (liquid_) liquid_->add_stages(schedule_, readback_, world_, vec_cast<float>(scene_.gravity_m_s2));
  fine_surface_.hull().add_reports(readback_);
  if (coarse_surface_) coarse_surface_->hull().add_reports(readback_);
  surface_report_ = readback_.add(world_.first().surface.report_view());
  Stage read{.name = "frame/read back",
             .timed_as = "read back",
             .rate = Rate::end,
             .devices = StageDevices::all,
             .submit = [this](BlockPlace) { readback_.submit(); }};
  for (const auto& body : bodies_) {
    read.reads.push_back(body->report_resource());
    if (body->contact_point_count() > 0) read.reads.push_back(body->contact_resource());
  }
  for (const Resource& report : touching_.report_resources()) read.reads.push_back(report);
  if (liquid_) read.reads.push_back(SceneLiquid::report_resource());
  schedule_.add(std::move(read));
}

StepReport Simulation::step(const FrameSet* frame, double dt_s) {
  timings_.begin_frame();
  const StageTimer whole(timings_, "frame");
  StepReport report;
  report.notices = std::exchange(start_notices_, {});
  if (!std::exchange(is_settled_, true)) settle(report);
  FrameTimes times = clock_.next(dt_s, frame != nullptr || !is_filmed_);
  report.dt_s = last_dt_s_ = times.dt_s;
  std::move(times.notices.begin(), times.notices.end(), std::back_inserter(report.notices));
  bool has_new_images = frame != nullptr;
  if (has_new_images) {
    begin_quality();
    has_surface_ = true;
    incoming_ = frame;
    masks_ = follow_blades(silhouettes(*frame, report.notices), *frame, times.dt_capture_s, report.notices);
    tick_ = frame->tick;
    captured_s_ = frame->captured_s > 0 ? frame->captured_s : now_s();
    released_s_ = frame->captured_s > 0 ? frame->released_s : 0;
  }
  move_tools(times, has_new_images);
  contact_log_.begin_frame();
  part_ = 0;
  if (liquid_) look_ahead_of_liquid(times.dt_s);
  const double frame_begin_s = clock_.simulated_s() - times.dt_s;
  double done_s = 0;
  if (has_new_images && must_look_first(times.dt_s))
    run_part(times, {}, 0, std::exchange(has_new_images, false));
  for (FramePart part{.last = false}; !part.last; ++part_) {
    part = times.dt_s > 0 ? next_part(times.dt_s - done_s, std::abs(times.surface_age_s) + times.dt_s,
                                      frame_begin_s + done_s, report.substeps)
                          : FramePart{};
    if (part.substeps > 0) {
      for (auto& body : bodies_)
        body->check_substeps(static_cast<float>(part.dt_s), part.substeps, scene_.frame.max_substeps);
    }
    if (liquid_ && part.substeps > 0) part.liquid_steps = liquid_->steps_for(part.dt_s);
    if (liquid_ && part.liquid_steps == 0) liquid_->pass_time(part.dt_s);
    run_part(times, part, done_s, std::exchange(has_new_images, false));
    if (part.substeps > 0) collect_bodies(times.dt_s, part.substeps, report);
    done_s += part.dt_s;
    report.substeps += part.substeps;
    report.liquid_steps += part.liquid_steps;
  }
  if (report.substeps > 0) report.contact.contacts_per_substep /= report.substeps;
  cut_bodies(frame_begin_s, clock_.simulated_s(), report);
  collect(report);
  if (frame != nullptr) note_latency();
  return report;
}

void Simulation::run_part(const FrameTimes& times, const FramePart& part, double begin_s,
                          bool has_new_images) {
  const auto dt_substep_s = static_cast<float>(part.dt_s) / static_cast<float>(std::max(part.substeps, 1));
  const double begin_run_s = now_s();
  schedule_.run({.dt_s = dt_substep_s,
                 .dt_before_s = last_substep_s_,
                 .dt_capture_s = static_cast<float>(times.dt_capture_s),
                 .surface_age_s = static_cast<float>(times.surface_age_s + begin_s),
                 .gravity_m_s2 = vec_cast<float>(scene_.gravity_m_s2),
                 .substeps = part.substeps,
                 .part = part_},
                has_new_images,
                {.count = part.liquid_steps,
                 .dt_s = static_cast<float>(part.dt_s) / static_cast<float>(std::max(part.liquid_steps, 1)),
                 .variant = liquid_ ? liquid_->variant() : 0});
  if (has_new_images && !is_reduced(QualityReduction::hull))  // while the devices work
    hull_check_.prepare(incoming_->silhouettes,
                        tracked_blades_.empty() ? std::span<const BitMask>() : masks_);
  if (part.substeps > 0) last_substep_s_ = dt_substep_s;
  schedule_.finish(timings_);
  if (liquid_) liquid_->balance(readback_);
  if (liquid_ && part.substeps > 0) liquid_->follow(readback_);
  if (has_new_images)
    meshed_s_ = begin_run_s +
                1e-3 * (timings_.last_ms("upload") + timings_.last_ms("hull") + timings_.last_ms("mesh"));
  if (!has_surface_) return;
  const RealSurfaceReport surface = readback_.get<RealSurfaceReport>(surface_report_)[0];
  component_speeds_ = tool_speeds_;
  for (Index k = 0; k < surface.components.count; ++k) {
    const SurfaceMotion& motion = surface.motions.at(static_cast<std::size_t>(k));
    const SurfaceComponent& component = surface.components.component[k];
    if (motion.source == MotionSource::too_fast || component.samples == 0) continue;
    const float turning = 0.5F * component.size_m() * length(motion.spin_rad_s);
    component_speeds_.push_back({vec_cast<double>(component.low_m), vec_cast<double>(component.high_m),
                                 double{length(motion.velocity_m_s) + turning}});
  }
}

/// Whether the bodies can't be stepped before it is known how the new surface moves: it was still, or
/// unknown, or it was that fast.
bool Simulation::must_look_first(double dt_s) const {
  if (scene_.frame.substeps || !(dt_s > 0)) return false;
  return std::any_of(bodies_.begin(), bodies_.end(), [&](const auto& body) {
    const double moved_m = surface_m_s() * dt_s;
    return !body->is_untouched() && !body->is_frozen() &&
           (moved_m < 0.01 * body->spacing_m() || moved_m > 0.5 * body->spacing_m());
  });
}

/// Fills the report from the frame's records.
void Simulation::collect(StepReport& report) {
  const auto warn = [&](const char* code, const std::string& text, const std::string& remedy = "") {
    if (!text.empty()) report.notices.push_back({code, Severity::warning, text, remedy});
  };
  if (liquid_) {
    report.liquid = liquid_->report(readback_, report.notices);
    report.liquid_waiting_m3 = liquid_->waiting_m3(readback_, report.dt_s, report.notices);
    liquid_->add_bleeding(readback_, cuts_);
  }
  for (auto& body : bodies_)
    warn("body.inverted", body->newly_inverted(), "press it less or slower, or take a finer lattice");
  watch_bodies(report);
  if (!has_surface_) return;
  report.hull = hull().report(readback_);
  if (const auto& overflow = report.hull.overflow)
    warn("hull.overflow", overflow->text("reconstruction." + overflow->option));
  warn("hull.depth", report.hull.depth);
  // A hull that lacks capacity is open, which is no fault of the rig.
  if (incoming_ != nullptr && !report.hull.overflow && !is_reduced(QualityReduction::hull))
    warn("hull.check", hull_check_.report(devices_.context(0)));
  incoming_ = nullptr;
  const RealSurfaceReport surface = readback_.get<RealSurfaceReport>(surface_report_)[0];
  if (const Index dropped = surface.dropped_raw_samples + surface.dropped_samples; dropped > 0) {
    warn("surface.overflow", std::to_string(dropped) + " samples of the real surface were dropped",
         "raise contact.sample_spacing_m");
  }
  if (report.substeps > 0) report_fast_components(surface, report);
}

/// The reactions of one body to one thing in several parts of a frame become one.
void Simulation::collect_bodies(double dt_frame_s, int substeps, StepReport& report) {
  const RealSurfaceReport surface = readback_.get<RealSurfaceReport>(surface_report_)[0];
  const auto name_of = [&](Index collider) {
    if (collider < kComponents) return std::to_string(surface.components.component[collider].label);
    if (collider < kColliders)
      return world_.first().obstacles.names().at(static_cast<std::size_t>(collider - kComponents));
    return bodies_.at(static_cast<std::size_t>(collider - kColliders))->name();
  };
  if (liquid_) liquid_->add_forces(readback_, name_of, dt_frame_s, report.liquid_forces);
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const auto& body = bodies_[b];
    ContactReport contact = body->contact(readback_, static_cast<float>(dt_frame_s), substeps);
    note_contact(contact);
    contact.contacts_per_substep *= substeps;
    report.contact.add(contact);
    for (const ColliderReaction& r : contact.colliders)
      add_contact({body->name(), name_of(r.collider), r}, report);
    if (contact_log_.is_asked(b)) log_points(b, name_of);
    const std::string trouble = body->end_frame(devices_.context(0), readback_, substeps);
    if (!trouble.empty()) report.notices.push_back({"body.blew_up", Severity::warning, trouble, ""});
  }
  for (const PairReaction& r : touching_.reactions(readback_, static_cast<float>(dt_frame_s))) {
    const auto name = [&](Index b) { return bodies_[static_cast<std::size_t>(b)]->name(); };
    add_contact({name(r.body), name(r.other), r.reaction}, report);
    if (r.body == r.other) continue;  // gives its momentum to itself
    contact_log_.add(
        static_cast<std::size_t>(r.other),
        {.other = name(r.body), .kind = ColliderKind::body, .impulse_N_s = r.reaction.impulse_N_s});
  }
}

void Simulation::log_points(std::size_t body, const std::function<std::string(Index)>& name_of) {
  const auto obstacles = static_cast<Index>(scene_.obstacles.size());  // blades follow them
  for (const ContactPoint& p : bodies_[body]->contacts()) {
    const ColliderKind kind = p.collider < kComponents               ? ColliderKind::component
                              : p.collider - kComponents < obstacles ? ColliderKind::obstacle
                                                                     : ColliderKind::tool;
    contact_log_.add(
        body, {p.point, name_of(p.collider), kind, p.x_m, p.n, p.gap_m, p.impulse_N_s, 0, {}, p.state});
  }
}

void Simulation::add_contact(const BodyContact& contact, StepReport& report) {
  const auto known = std::find_if(report.contacts.begin(), report.contacts.end(), [&](const BodyContact& c) {
    return c.body == contact.body && c.component == contact.component;
  });
  if (known == report.contacts.end())
    report.contacts.push_back(contact);
  else
    add(known->reaction, contact.reaction);
}

std::vector<BodyMonitors> Simulation::monitors() {
  std::vector<BodyMonitors> all;
  for (const auto& body : bodies_) all.push_back(body->monitors(devices_.context(0), last_substep_s_));
  return all;
}

std::vector<std::vector<Vec3d>> Simulation::motion_forces_N() {
  std::vector<std::vector<Vec3d>> all;
  for (const auto& body : bodies_) all.push_back(body->motion_forces_N(last_dt_s_));
  return all;
}

std::vector<std::vector<Vec3d>> Simulation::motion_torques_N_m() {
  std::vector<std::vector<Vec3d>> all;
  for (const auto& body : bodies_) all.push_back(body->motion_torques_N_m(last_dt_s_));
  return all;
}

std::vector<Vec3f> Simulation::probe_positions_m() {
  std::vector<Vec3f> positions;
  for_each_probe([&](const Probe& probe, std::span<const Vec3f> x_m) {
    positions.push_back(probe.point.position_m(x_m));
  });
  return positions;
}

std::vector<CubeStrain> Simulation::probe_strains() {
  std::vector<CubeStrain> strains;
  for_each_probe([&](const Probe& probe, std::span<const Vec3f> x_m) {
    strains.push_back(probe.strain.mean(bodies_[probe.body]->strains(x_m, probe.strain.cubes)));
  });
  return strains;
}

/// @param use is called with each probe and its body's nodes
void Simulation::for_each_probe(const std::function<void(const Probe&, std::span<const Vec3f>)>& use) {
  std::vector<std::vector<Vec3f>> nodes_m(bodies_.size());  // of bodies with probes, each once
  for (const Probe& probe : probes_) {
    std::vector<Vec3f>& x_m = nodes_m[probe.body];
    if (x_m.empty()) x_m = bodies_[probe.body]->positions_m(devices_.context(0));
    use(probe, x_m);
  }
}

}  // namespace tactus
