// Notices of bodies that are where none can be, or that gained energy.
#include <algorithm>
#include <utility>

#include "tactus/base/log.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/world/hold_check.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

bool holds(Vec3d low, Vec3d high, Vec3d p) {
  const Vec3d out = max(low - p, p - high);
  return std::max({out.x, out.y, out.z}) < 0;
}

/// Whether gravity alone is known to act on the bodies.
bool nothing_acts(const Scene& scene) {
  if (scene.frame.start == FrameStart::settled || scene.fluid || !scene.blades.empty()) return false;
  if (std::any_of(scene.obstacles.begin(), scene.obstacles.end(), [](const auto& o) { return o.moves(); }))
    return false;
  return std::none_of(scene.bodies.begin(), scene.bodies.end(),
                      [](const BodyDescription& body) { return !body.moved.empty() || !body.loads.empty(); });
}

}  // namespace

EnergyWatch World::Impl::make_energy_watch() const {
  if (!nothing_acts(scene_)) return {};
  std::vector<EnergyWatch::Body> bodies;
  for (const auto& body : bodies_) {
    EnergyWatch::Body& at_rest = bodies.emplace_back();
    at_rest.name = body->name();
    at_rest.spacing_m = body->description().spacing_m;
    const CubeLattice& lattice = body->shape().lattice;
    Vec3d sum{};
    for (Index n = 0; n < lattice.node_count(); ++n) {
      const double mass_kg = double{lattice.node_mass_kg[static_cast<std::size_t>(n)]};
      at_rest.mass_kg += mass_kg;
      sum += mass_kg * vec_cast<double>(lattice.rest_m(n));
    }
    at_rest.center_m = (1 / at_rest.mass_kg) * sum;
  }
  return {std::move(bodies), scene_.gravity_m_s2};
}

void World::Impl::report_falling_bodies(std::span<const ObstacleDescription> obstacles) {
  for (const auto& body : bodies_) {
    const BodyDescription& of = body->description();
    if (!of.fixed.empty() || !of.moved.empty() || !scene_.obstacles.empty() ||
        !(dot(scene_.gravity_m_s2, scene_.gravity_m_s2) > 0) || is_over_liquid(scene_, *body))
      continue;
    log_warning("body '" + of.name + "': gravity pulls and nothing is 'fixed': it will fall");
    fall_watch_.leave_out(of.name);
  }
  for (UnheldBody& unheld : bodies_without_floor(scene_, bodies_, obstacles)) {
    fall_watch_.leave_out(unheld.body);
    start_notices_.push_back(std::move(unheld.notice));
  }
}

/// Where there are neither obstacles nor a liquid, it was told at the start that all will fall.
FallWatch World::Impl::make_fall_watch(std::span<const ObstacleDescription> obstacles) const {
  if (scene_.obstacles.empty() && !scene_.fluid) return {};
  std::vector<Box3f> boxes_m;
  for (const auto& body : bodies_) boxes_m.push_back(bounds(body->shape().surface_m));
  if (perception_ != nullptr) boxes_m.push_back(perception_->workspace_m());
  if (scene_.fluid)
    boxes_m.push_back({vec_cast<float>(scene_.fluid->box.min_m), vec_cast<float>(scene_.fluid->box.max_m)});
  return {obstacles, boxes_m, scene_.gravity_m_s2};
}

/// A body that is carried down, or slides down a slope, touches something.
std::string World::Impl::falls_for_ever(std::size_t body, const StepReport& report) {
  const BodyDescription& of = scene_.bodies[body];
  if (!of.fixed.empty() || !of.moved.empty() || (grab_ && grabbed_ == body)) return "";
  if (std::any_of(report.contacts.begin(), report.contacts.end(),
                  [&](const BodyContact& c) { return c.body == of.name; }))
    return "";
  const RigidMotion& motion = bodies_[body]->status().motion;
  const Vec3d size_m = motion.high_m - motion.low_m;
  return fall_watch_.follow(of.name, motion.center_m, std::max({size_m.x, size_m.y, size_m.z}));
}

/// The work of the real object or a tool is summed up nowhere.
void World::Impl::note_contact(const ContactReport& contact) {
  const auto still = static_cast<Index>(scene_.obstacles.size());
  for (const ColliderReaction& r : contact.colliders)
    if (r.collider < kComponents || r.collider - kComponents >= still) energy_watch_.turn_off();
}

std::string World::Impl::gained_energy() {
  if (!energy_watch_.is_on()) return "";
  std::vector<EnergyWatch::Body> bodies;
  for (const auto& body : bodies_) {
    const RigidMotion& motion = body->status().motion;
    if (body->status().is_frozen) energy_watch_.turn_off();
    bodies.push_back(
        {body->name(), motion.mass_kg, body->description().spacing_m, motion.center_m, motion.kinetic_J});
  }
  return energy_watch_.follow(bodies, double{last_substep_s_});
}

ObstacleWatch::Surface World::Impl::surface_of(const SoftBody& body) const {
  return [this, &body] { return body.surface().to_mesh(devices_.context(0)); };
}

/// The other body whose box holds the centre of a body, and then its surface round it.
std::string World::Impl::inside_a_body(std::size_t body) {
  if (!scene_.contact.bodies) return "";
  const SoftBody& of = *bodies_[body];
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const SoftBody& other = *bodies_[b];
    const RigidMotion& there = other.status().motion;
    if (b == body || !other.description().contact || !(there.mass_kg > 0) ||
        !holds(there.low_m, there.high_m, of.status().motion.center_m))
      continue;
    std::string text = obstacle_watch_.find_in(of.name(), of.status().motion.center_m, surface_of(of),
                                               "body '" + other.name() + "'", surface_of(other));
    if (!text.empty()) return text;
  }
  return "";
}

/// A body so fast that no frame shows it inside of another.
std::string World::Impl::through_a_body(std::size_t body) {
  const SoftBody& of = *bodies_[body];
  if (!scene_.contact.bodies || !of.description().contact || of.status().is_frozen) return "";
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const SoftBody& other = *bodies_[b];
    const RigidMotion& there = other.status().motion;
    if (b == body || !other.description().contact || !(there.mass_kg > 0)) continue;
    std::string text = obstacle_watch_.find_through(
        of.name(), other.name(), {vec_cast<float>(there.low_m), vec_cast<float>(there.high_m)},
        surface_of(other));
    if (!text.empty()) return text;
  }
  return "";
}

/// A body that jumped in has no point near the surface: nothing tells contact of it.
std::string World::Impl::inside_the_surface(std::size_t body) {
  if (!has_surface_) return "";
  const Vec3d center_m = bodies_[body]->status().motion.center_m;
  const RealSurfaceReport found = readback_.get<RealSurfaceReport>(surface_report_)[0];
  for (Index k = 0; k < found.components.count; ++k) {
    const SurfaceComponent& component = found.components.component[k];
    if (!holds(vec_cast<double>(component.low_m), vec_cast<double>(component.high_m), center_m)) continue;
    return obstacle_watch_.find_in(bodies_[body]->name(), center_m, surface_of(*bodies_[body]),
                                   "component " + std::to_string(component.label) + " of the real surface",
                                   [&] { return perception_->download(); });
  }
  return "";
}

void World::Impl::watch_bodies(StepReport& report) {
  const auto warn = [&](const char* code, std::string text, const char* remedy) {
    if (!text.empty()) report.notices.push_back({code, Severity::warning, std::move(text), remedy});
  };
  if (report.substeps == 0) return;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const SoftBody& body = *bodies_[b];
    if (body.status().is_frozen) continue;
    warn("body.falls", falls_for_ever(b, report), FallWatch::kRemedy);
    if (!body.description().contact) continue;
    warn("body.in_obstacle",
         obstacle_watch_.follow(body.name(), body.status().motion.center_m, surface_of(body)),
         ObstacleWatch::kRemedy);
    if (frames_watched_ % kFramesToWatch != 0) continue;
    warn("body.in_body", inside_a_body(b), ObstacleWatch::kRemedy);
    warn("body.in_surface", inside_the_surface(b), ObstacleWatch::kRemedy);
  }
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    warn("body.in_body", through_a_body(b), ObstacleWatch::kRemedy);
  ++frames_watched_;
  warn("body.gains_energy", gained_energy(), EnergyWatch::kRemedy);
}

void World::Impl::report_fast_components(const RealSurfaceReport& surface, StepReport& report) const {
  for (Index k = 0; k < surface.components.count; ++k) {
    if (surface.motions.at(static_cast<std::size_t>(k)).source != MotionSource::too_fast) continue;
    const auto most_m_s = static_cast<int>(colliders_.first().surface.settings().max_speed_m_s);
    report.notices.push_back({"surface.too_fast", Severity::warning,
                              "component " + std::to_string(surface.components.component[k].label) +
                                  " of the real surface is faster than " + std::to_string(most_m_s) +
                                  " m/s: it touches nothing in this frame",
                              "move it more slowly, or film more frames per second"});
  }
}

}  // namespace tactus
