#include "tactus/world/energy_watch.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

namespace tactus {

EnergyWatch::EnergyWatch(std::vector<Body> bodies, Vec3d gravity_m_s2)
    : begin_(std::move(bodies)), gravity_m_s2_(gravity_m_s2), is_on_(!begin_.empty()) {}

std::string EnergyWatch::follow(std::span<const Body> bodies, double step_s) {
  if (!is_on_ || bodies.size() != begin_.size()) return "";
  double gained_J = 0, most_J = 0, moving_J = 0, fallen_J = 0, allowed_J = 0;
  std::size_t most = 0;
  const double gravity = length(gravity_m_s2_);
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    const Body& body = bodies[b];
    const double fell_J = potential_J(begin_[b]) - potential_J(body), gain_J = body.kinetic_J - fell_J;
    gained_J += gain_J;
    moving_J += body.kinetic_J;
    fallen_J += fell_J;
    if (gain_J > most_J) most_J = gain_J, most = b;
    // A body that rises was faster half a step ago, by g dt / 2.
    allowed_J += gravity * (kLift * body.mass_kg * body.spacing_m +
                            0.5 * step_s * std::sqrt(2 * body.mass_kg * body.kinetic_J)) +
                 0.5 * body.mass_kg * kRounding_m_s * kRounding_m_s;
  }
  turned_J_ = std::max({turned_J_, moving_J - std::max(gained_J, 0.0), fallen_J});
  if (!(gained_J > allowed_J + kShare * turned_J_)) return "";
  turn_off();
  char text[160];
  std::snprintf(text, sizeof text,
                "' gained most of %.3g J that nothing gave the bodies: contact or long steps did", gained_J);
  return "body '" + begin_[most].name + text;
}

}  // namespace tactus
