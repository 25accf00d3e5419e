#include "tactus/world/world_impl.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/sim/body/body_measures.h"
#include "tactus/sim/body/body_pull.h"
#include "tactus/sim/body/body_steps.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/world/start_check.h"
#include "tactus/world/weight_check.h"

namespace tactus {
namespace {

std::vector<std::string> names_of(const std::vector<BodyDescription>& bodies) {
  std::vector<std::string> names;
  for (const BodyDescription& body : bodies) names.push_back(body.name);
  return names;
}

/// Between samples of the real surface; without bodies, by its voxels, and without cameras nothing is
/// sampled.
float sample_spacing_m(const Scene& scene, const Perception* perception) {
  if (scene.contact.sample_spacing_m) return static_cast<float>(*scene.contact.sample_spacing_m);
  const float voxel_size_m = perception != nullptr ? perception->voxel_size_m() : 0.05F;
  double spacing =
      scene.bodies.empty() ? 2 * static_cast<double>(voxel_size_m) : scene.bodies.front().spacing_m;
  for (const BodyDescription& body : scene.bodies) spacing = std::min(spacing, body.spacing_m);
  return static_cast<float>(spacing);
}

RealSurfaceSettings surface_settings(const Perception* perception, float spacing_m) {
  RealSurfaceSettings settings;
  settings.sample_spacing_m = spacing_m;
  if (perception == nullptr) {  // the least that can be
    settings.max_vertices = settings.max_triangles = settings.max_raw_samples = settings.max_samples = 64;
    return settings;
  }
  const MeshView mesh = perception->impl().surface();
  settings.max_vertices = mesh.positions_m.size();
  settings.max_triangles = mesh.triangles.size();
  settings.max_raw_samples = std::max(settings.max_raw_samples, 2 * mesh.triangles.size());
  return settings;
}

/// All that bodies touch: the scene's, and tools that cameras see.
std::vector<ObstacleDescription> touched_obstacles(const Scene& scene, const BodyAssets& assets,
                                                   const Perception* perception) {
  std::vector<ObstacleDescription> all = obstacle_descriptions(scene, assets);
  return perception != nullptr ? perception->impl().tracked_blades().after(std::move(all)) : all;
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
    if (body->description().contact) count = std::max(count, body->tissue().slab_count());
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

World::Impl::Impl(DeviceSet& devices, const Scene& scene, const BodyAssets& assets, Perception* perception)
    : devices_(devices),
      scene_(checked(scene, assets)),
      perception_(perception),
      sample_spacing_m_(sample_spacing_m(scene, perception)),
      bodies_([&] {
        std::vector<std::unique_ptr<SoftBody>> bodies;
        for (const BodyDescription& body : scene.bodies)
          bodies.push_back(std::make_unique<SoftBody>(devices, body, assets, touches_bodies(scene, body)));
        return bodies;
      }()),
      moving_obstacles_(scene, obstacle_descriptions(scene, assets)),
      held_blades_(scene),
      obstacle_watch_(still_ones(obstacle_descriptions(scene, assets))),
      energy_watch_(make_energy_watch()),
      contact_log_(names_of(scene.bodies)),
      colliders_(devices, std::max(devices_that_touch(bodies_), SceneLiquid::part_count(devices, scene)),
                 surface_settings(perception, sample_spacing_m_),
                 {.restitution = static_cast<float>(scene.contact.restitution),
                  .friction = static_cast<float>(scene.contact.friction),
                  .response = scene.contact.response},
                 touched_obstacles(scene, assets, perception)),
      touching_(devices.context(0), bodies_, scene.contact, scene.frame),
      readback_(devices),
      schedule_(devices),
      clock_(scene.frame.max_dt_s, scene.frame.dt_s),
      is_settled_(scene.frame.start == FrameStart::undeformed),
      timings_(scene.output.trace) {
  check_settles();
  if (perception != nullptr && &perception->impl().devices() != &devices)
    throw usage_error("a World's Perception is expected on the same DeviceSet object as the World");
  if (perception != nullptr) tools_.motions = perception->impl().tracked_blades().motions();
  for (const ProbeDescription& probe : scene.probes) add_probe(probe);
  add_plans();
  const std::vector<ObstacleDescription> obstacles = obstacle_descriptions(scene, assets);
  start_notices_ = overlaps_at_start(scene, bodies_, still_ones(obstacles));
  report_tiny_obstacles(obstacles, start_notices_);
  for (Notice& notice : heavy_bodies(scene, bodies_)) start_notices_.push_back(std::move(notice));
  fall_watch_ = make_fall_watch(touched_obstacles(scene, assets, perception));
  report_falling_bodies(obstacles);
  if (perception != nullptr) report_far_bodies(scene, bodies_, perception->workspace_m(), start_notices_);
  if (scene.fluid)
    liquid_ = std::make_unique<SceneLiquid>(devices, scene, bodies_, obstacle_descriptions(scene, assets));
  if (liquid_ && perception != nullptr)
    liquid_->wet_real(
        colliders_.first().surface, [perception] { return perception->impl().surface(); },
        perception->voxel_size_m());
  add_stages();
  add_parameters();
  schedule_.close();
  devices_.synchronize();
}

World::Impl::~Impl() {
  try {
    devices_.synchronize();
  } catch (const std::exception& error) {  // of a device that failed: somebody has its error
    log_warning(error.what());
  }
}

void World::Impl::add_probe(const ProbeDescription& probe) {
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

void World::Impl::add_stages() {
  const StageDevices touching = colliders_.count() > 1 ? StageDevices::all : StageDevices::first;
  add_surface_stages(touching);
  schedule_.add({.name = "contact/begin",
                 .timed_as = "begin",
                 .rate = Rate::before,
                 .devices = touching,
                 .writes = {"contact/poses"},
                 .submit = [this](BlockPlace) { colliders_.begin_frame(schedule_.frame()); }});
  for (auto& body : bodies_)
    body->add_stages(schedule_, readback_, colliders_, vec_cast<float>(scene_.gravity_m_s2));
  touching_.add_stages(schedule_, readback_, colliders_.part(0).contact);
  if (liquid_) liquid_->add_stages(schedule_, readback_, colliders_, vec_cast<float>(scene_.gravity_m_s2));
  surface_report_ = readback_.add(colliders_.first().surface.report_view());
  Stage read{.name = "frame/read back",
             .timed_as = "read back",
             .rate = Rate::end,
             .devices = StageDevices::all,
             .submit = [this](BlockPlace) { readback_.submit(); }};
  for (const auto& body : bodies_) {
    read.reads.push_back(body->resources().report);
    if (body->points().count() > 0) read.reads.push_back(body->resources().contact_report);
  }
  for (const Resource& report : touching_.report_resources()) read.reads.push_back(report);
  if (liquid_) read.reads.push_back(SceneLiquid::report_resource());
  schedule_.add(std::move(read));
}

StepReport World::Impl::step(double dt_s) {
  begin_step(dt_s);
  for (;;)
    if (std::optional<StepReport> report = continue_step()) return *std::move(report);
}

void World::Impl::begin_step(double dt_s) {
  if (open_)
    throw usage_error("begin_step: a frame is open, expected continue_step() until it gives a report");
  OpenFrame frame{.begin_s = now_s()};
  timings_.begin_frame();
  frame.report.notices = std::exchange(start_notices_, {});
  if (seen_.is_new) frame.begin_s -= seen_.observe_s;
  if (!std::exchange(is_settled_, true)) settle(frame.report);
  frame.times = clock_.next(dt_s, seen_.is_new || perception_ == nullptr);
  frame.report.dt_s = last_dt_s_ = frame.times.dt_s;
  std::move(frame.times.notices.begin(), frame.times.notices.end(), std::back_inserter(frame.report.notices));
  frame.is_new = frame.uploads = begin_images(frame.report);
  begin_grab();
  move_tools(frame.times, frame.is_new);
  contact_log_.begin_frame();
  part_ = 0;
  if (liquid_) look_ahead_of_liquid(frame.times.dt_s);
  frame.looks_first = frame.is_new && must_look_first(frame.times.dt_s);
  submit_part(frame);
  open_ = std::move(frame);
}

std::optional<StepReport> World::Impl::continue_step() {
  if (!open_) throw usage_error("continue_step: no frame is open, expected begin_step() before");
  OpenFrame frame = *std::exchange(open_, std::nullopt);  // one that fails is none any more
  finish_part(frame);
  if (!frame.part.last) {
    submit_part(frame);
    open_ = std::move(frame);
    return std::nullopt;
  }
  StepReport& report = frame.report;
  if (report.substeps > 0) report.contact.contacts_per_substep /= report.substeps;
  if (grab_) report.grab_N = bodies_[grabbed_]->spring().mean_force_N(report.dt_s);
  collect(report);  // before a body grows: then the records that it left are gone
  cut_bodies(clock_.simulated_s() - report.dt_s, clock_.simulated_s(), report);
  if (frame.is_new) note_latency();
  timings_.add("frame", frame.begin_s, now_s());
  return std::move(report);
}

/// The frame's parts come one after the other.
void World::Impl::submit_part(OpenFrame& frame) {
  const FrameTimes& times = frame.times;
  const double from_s = clock_.simulated_s() - times.dt_s + frame.done_s;
  FramePart& part = frame.part = {};
  if (frame.looks_first)
    part.last = false;
  else if (times.dt_s > 0)
    part = next_part(times.dt_s - frame.done_s, std::abs(times.surface_age_s) + times.dt_s, from_s,
                     frame.report.substeps);
  if (part.substeps > 0) {
    for (auto& body : bodies_)
      body->steps().check(static_cast<float>(part.dt_s), part.substeps, scene_.frame.max_substeps);
  }
  if (liquid_ && !frame.looks_first) {
    if (part.substeps > 0) part.liquid_steps = liquid_->steps_for(part.dt_s);
    if (part.liquid_steps == 0) liquid_->pass_time(part.dt_s);
    liquid_->expect(part.liquid_steps);
  }
  const auto dt_substep_s = static_cast<float>(part.dt_s) / static_cast<float>(std::max(part.substeps, 1));
  frame.part_begin_s = now_s();
  schedule_.run({.dt_s = dt_substep_s,
                 .dt_before_s = last_substep_s_,
                 .dt_capture_s = static_cast<float>(times.dt_capture_s),
                 .surface_age_s = static_cast<float>(times.surface_age_s + frame.done_s),
                 .gravity_m_s2 = vec_cast<float>(scene_.gravity_m_s2),
                 .substeps = part.substeps,
                 .part = part_},
                frame.uploads,
                {.count = part.liquid_steps,
                 .dt_s = static_cast<float>(part.dt_s) / static_cast<float>(std::max(part.liquid_steps, 1)),
                 .variant = liquid_ ? liquid_->variant() : 0});
  if (frame.uploads) perception_->impl().prepare_check();  // while the devices work
  if (part.substeps > 0) last_substep_s_ = dt_substep_s;
}

void World::Impl::finish_part(OpenFrame& frame) {
  const FramePart& part = frame.part;
  schedule_.finish(timings_);
  if (liquid_) liquid_->balance(readback_);
  if (liquid_ && part.substeps > 0) liquid_->follow(readback_, part.dt_s);
  if (std::exchange(frame.uploads, false))
    meshed_s_ = frame.part_begin_s +
                1e-3 * (timings_.last_ms("upload") + timings_.last_ms("hull") + timings_.last_ms("mesh"));
  if (has_surface_) find_component_speeds();
  if (part.substeps > 0) collect_bodies(frame.times.dt_s, part.substeps, frame.report);
  frame.done_s += part.dt_s;
  frame.report.substeps += part.substeps;
  frame.report.liquid_steps += part.liquid_steps;
  if (!std::exchange(frame.looks_first, false)) ++part_;
}

void World::Impl::find_component_speeds() {
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
bool World::Impl::must_look_first(double dt_s) const {
  if (scene_.frame.substeps || !(dt_s > 0)) return false;
  return std::any_of(bodies_.begin(), bodies_.end(), [&](const auto& body) {
    const double moved_m = surface_m_s() * dt_s;
    return body->description().contact && !body->status().is_frozen &&
           (moved_m < 0.01 * body->description().spacing_m || moved_m > 0.5 * body->description().spacing_m);
  });
}

/// Fills the report from the frame's records.
void World::Impl::collect(StepReport& report) {
  const auto warn = [&](const char* code, const std::string& text, const std::string& remedy = "") {
    if (!text.empty()) report.notices.push_back({code, Severity::warning, text, remedy});
  };
  if (liquid_) {
    report.liquid = liquid_->report(readback_, report.notices);
    report.liquid_waiting_m3 = liquid_->waiting_m3(readback_, report.dt_s, report.notices);
    report.film = liquid_->film_report(readback_);
    liquid_->add_bleeding(readback_, cuts_);
  }
  for (auto& body : bodies_)
    warn("body.inverted", body->newly_inverted(), "press it less or slower, or take a finer lattice");
  watch_bodies(report);
  if (!has_surface_) return;
  report.hull = perception_->impl().report(readback_, report.notices);
  const RealSurfaceReport surface = readback_.get<RealSurfaceReport>(surface_report_)[0];
  if (const Index dropped = surface.dropped_raw_samples + surface.dropped_samples; dropped > 0) {
    warn("surface.overflow", std::to_string(dropped) + " samples of the real surface were dropped",
         "raise contact.sample_spacing_m");
  }
  if (report.substeps > 0) report_fast_components(surface, report);
}

/// The reactions of one body to one thing in several parts of a frame become one.
void World::Impl::collect_bodies(double dt_frame_s, int substeps, StepReport& report) {
  const RealSurfaceReport surface = readback_.get<RealSurfaceReport>(surface_report_)[0];
  const auto name_of = [&](Index collider) {
    if (collider < kComponents) return std::to_string(surface.components.component[collider].label);
    if (collider < kColliders)
      return colliders_.first().obstacles.names().at(static_cast<std::size_t>(collider - kComponents));
    return bodies_.at(static_cast<std::size_t>(collider - kColliders))->name();
  };
  if (liquid_) liquid_->add_forces(readback_, name_of, dt_frame_s, report.liquid_forces);
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const auto& body = bodies_[b];
    ContactReport contact = body->points().report(readback_, static_cast<float>(dt_frame_s), substeps);
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

void World::Impl::log_points(std::size_t body, const std::function<std::string(Index)>& name_of) {
  const auto obstacles = static_cast<Index>(scene_.obstacles.size());  // blades follow them
  for (const ContactPoint& p : bodies_[body]->points().contacts()) {
    const ColliderKind kind = p.collider < kComponents               ? ColliderKind::component
                              : p.collider - kComponents < obstacles ? ColliderKind::obstacle
                                                                     : ColliderKind::tool;
    contact_log_.add(
        body, {p.point, name_of(p.collider), kind, p.x_m, p.n, p.gap_m, p.impulse_N_s, 0, {}, p.state});
  }
}

void World::Impl::add_contact(const BodyContact& contact, StepReport& report) {
  const auto known = std::find_if(report.contacts.begin(), report.contacts.end(), [&](const BodyContact& c) {
    return c.body == contact.body && c.component == contact.component;
  });
  if (known == report.contacts.end())
    report.contacts.push_back(contact);
  else
    add(known->reaction, contact.reaction);
}

const SoftBody& World::Impl::body(const std::string& name) const {
  for (const auto& b : bodies_)
    if (b->name() == name) return *b;
  throw usage_error("body '" + name + "' is not in the scene" + suggestion(name, names_of(scene_.bodies)));
}

BodyNodes World::Impl::nodes(const std::string& name) {
  const SoftBody& of = body(name);
  BodyNodes nodes{of.positions_m(context()), of.velocities_m_s(context())};
  const auto in_use = static_cast<std::size_t>(nodes_in_use(of.shape().lattice));
  nodes.positions_m.resize(in_use);
  nodes.velocities_m_s.resize(in_use);
  return nodes;
}

std::vector<BodyMonitors> World::Impl::monitors() {
  std::vector<BodyMonitors> all;
  for (const auto& body : bodies_)
    all.push_back(body->measures().monitors(devices_.context(0), last_substep_s_));
  return all;
}

std::vector<std::vector<MotionForce>> World::Impl::motion_forces() {
  std::vector<std::vector<MotionForce>> all;
  for (const auto& body : bodies_) {
    const auto [forces_N, torques_N_m] = body->tissue().motion_forces(last_dt_s_);
    std::vector<MotionForce>& of_body = all.emplace_back();
    for (std::size_t m = 0; m < forces_N.size(); ++m) of_body.push_back({forces_N[m], torques_N_m[m]});
  }
  return all;
}

std::vector<ProbeReading> World::Impl::probes() {
  std::vector<std::vector<Vec3f>> nodes_m(bodies_.size());  // of bodies with probes, each once
  std::vector<ProbeReading> readings;
  for (const Probe& probe : probes_) {
    const SoftBody& body = *bodies_[probe.body];
    std::vector<Vec3f>& x_m = nodes_m[probe.body];
    if (x_m.empty()) x_m = body.positions_m(devices_.context(0));
    readings.push_back(
        {probe.point.position_m(x_m), probe.strain.mean(body.measures().strains(x_m, probe.strain.cubes))});
  }
  return readings;
}

}  // namespace tactus
