/// Splits a frame into parts and chooses the substeps of each, by the speed of everything near a body.
#include <algorithm>
#include <cmath>

#include "tactus/sim/body/body_steps.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/world/world_impl.h"

namespace tactus {

int World::Impl::substeps_for(double dt_s, double substeps_per_s) const {
  int count = static_cast<int>(std::ceil(std::min(dt_s * substeps_per_s, double{kMostSubsteps})));
  for (const auto& body : bodies_)
    count = std::max(count, body->steps().substeps_for(static_cast<float>(dt_s)));
  if (liquid_) count = std::max(count, liquid_->substeps_for(dt_s));
  return std::clamp(count, 1, kMostSubsteps);
}

/// Bodies, too, may push the liquid.
void World::Impl::look_ahead_of_liquid(double dt_s) {
  std::vector<Reach> movers;
  for (const Reach& component : component_speeds_)
    if (component.m_s > 0) movers.push_back(component);
  for (const auto& body : bodies_) {
    if (!body->description().contact || body->status().is_frozen) continue;
    const RigidMotion& of = body->status().motion;
    // Nothing is known of its motion before its first substep.
    const Vec3d all{1e9, 1e9, 1e9};
    if (of.mass_kg > 0)
      movers.push_back({of.low_m, of.high_m, static_cast<double>(body->status().fastest_m_s())});
    else
      movers.push_back({-all, all, 0});
  }
  const double to_s = clock_.simulated_s();
  liquid_->look_ahead(to_s - dt_s, to_s, scene_.gravity_m_s2, movers);
}

double World::Impl::surface_m_s() const {
  double fastest = 0;
  for (const Reach& component : component_speeds_) fastest = std::max(fastest, component.m_s);
  return fastest;
}

/// Where neither a component nor the body gets out of its box by more than their ways, and boxes are farther
/// apart than that and contact's reach, the component doesn't count.
double World::Impl::surface_m_s(const SoftBody& body, double seconds) const {
  double fastest = 0;
  for (const Reach& component : component_speeds_) {
    const double displacement_m =
                     (component.m_s + static_cast<double>(body.status().fastest_m_s())) * seconds,
                 reach_m = 2 * (body.description().spacing_m + static_cast<double>(sample_spacing_m_));
    const RigidMotion& of = body.status().motion;
    const Vec3d apart = max(component.low_m - of.high_m, of.low_m - component.high_m);
    const bool far = of.mass_kg > 0 && std::max({apart.x, apart.y, apart.z}) > displacement_m + reach_m;
    if (!far) fastest = std::max(fastest, component.m_s);
  }
  return fastest;
}

World::Impl::FramePart World::Impl::next_part(double left_s, double age_s, double from_s, int done) {
  if (scene_.frame.substeps) return {left_s, *scene_.frame.substeps, true};
  double spacings_per_s = 0;  // that anything moves by
  double falls_per_s = 0;     // likewise, that it may gain until the middle of the frame
  int unstrained = 1;         // substeps of the rest of the frame
  for (const auto& body : bodies_) {
    spacings_per_s = std::max(
        spacings_per_s, body->steps().fastest_near_m_s(surface_m_s(*body, age_s), from_s, from_s + left_s) /
                            body->description().spacing_m);
    if (body->description().contact && !body->status().is_frozen)
      falls_per_s =
          std::max(falls_per_s, 0.5 * length(scene_.gravity_m_s2) * left_s / body->description().spacing_m);
    unstrained = std::max(unstrained, body->tissue().model().substeps_for(static_cast<float>(left_s)));
  }
  if (liquid_) unstrained = std::max(unstrained, liquid_->substeps_for(left_s));
  const auto in_units = [&](double count) {
    return ceil_div(static_cast<int>(std::ceil(count - 1e-6)), schedule_.unit()) * schedule_.unit();
  };
  // A part in which things move by a spacing, and in each of its substeps by a quarter.
  const double part_s = left_s / std::ceil(std::clamp(left_s * spacings_per_s, 1.0, double{kMostSubsteps}));
  // Substeps of a whole frame, which its parts share: a step that changes with each part adds energy. The
  // many substeps that a fast mover needs in its part are not kept for the frames after it.
  const double frame_s = last_dt_s_, rest_of_frame = left_s / frame_s;
  const int most = std::max(scene_.frame.max_substeps - done, unstrained),
            most_of_frame = static_cast<int>(std::min(most / rest_of_frame, double{kMostSubsteps})),
            needed = substeps_for(frame_s, 4 * (spacings_per_s + falls_per_s));
  const bool whole_frame = done == 0 && part_s == left_s;
  const int whole = in_units(whole_frame ? substep_choice_.of_frame(frame_s, needed, most_of_frame)
                                         : substep_choice_.of_part(frame_s, needed, most_of_frame));
  const int rest = in_units(whole * rest_of_frame), part = in_units(whole * part_s / frame_s);
  if (part >= rest) return {left_s, rest, true};
  return {frame_s * part / whole, part, false};
}

}  // namespace tactus
