// Checks the settings of a liquid and computes the constants that follow.
#include <algorithm>
#include <cmath>
#include <string>

#include "tactus/fluid/liquid.h"

namespace tactus {
namespace {

[[noreturn]] void refuse(const char* what, float value, const char* expected) {
  throw Error(std::string("liquid: ") + what + " is " + std::to_string(value) + ", must be " + expected);
}

CarreauLaw thinning_of(const LiquidSettings& s) {
  const Carreau c = s.carreau.value_or(Carreau{.zero_shear_Pa_s = s.viscosity_Pa_s});
  return {.zero_m2_s = c.zero_shear_Pa_s / s.density_kg_m3,
          .infinite_m2_s = s.viscosity_Pa_s / s.density_kg_m3,
          .relaxation_s = c.relaxation_s,
          .index = c.index};
}

/// The most particles may give a wall 1000 m/s in a frame: 2^62 units, a quarter of what a sum holds. (Not as
/// many as there is capacity for: results don't depend on it.)
float impulse_unit_N_s(const LiquidSettings& s) {
  const double most_kg = double{s.density_kg_m3} * std::pow(double{s.spacing_m}, 3) * kMostLiquidParticles;
  return static_cast<float>(std::ldexp(1.0, std::ilogb(1000 * most_kg) + 1 - 62));
}

}  // namespace

LiquidConstants constants_of(const LiquidSettings& s) {
  // The surface's shortest waves are fast, however slow the liquid is.
  const float d = s.spacing_m,
              speed_m_s = std::max(s.max_speed_m_s, std::sqrt(s.surface_tension_N_m / (s.density_kg_m3 * d))),
              sound = 10 * speed_m_s;
  // An incompressible liquid has no sound to damp, but jiggles.
  const float damped_m_s = s.solver == LiquidSolver::dfsph ? 4 * speed_m_s : sound;
  return {.kernel = {1.F / d},
          .spacing_m = d,
          .mass_kg = s.density_kg_m3 * d * d * d,
          .density_kg_m3 = s.density_kg_m3,
          .tait_Pa = s.density_kg_m3 * sound * sound / 7,
          .max_speed_m_s = speed_m_s,
          .sound_m_s = sound,
          .shear_m2_s = (s.carreau ? s.carreau->zero_shear_Pa_s : s.viscosity_Pa_s) / s.density_kg_m3,
          .damping_m2_s = s.artificial_viscosity * damped_m_s * d,
          .closest_m = 0.25F * d,
          .tension_N_m = s.surface_tension_N_m,
          .contact_cos = std::cos(s.contact_angle_deg * kPi / 180),
          .contact_sin = std::sin(s.contact_angle_deg * kPi / 180),
          .impulse_unit_N_s = impulse_unit_N_s(s),
          .thinning = thinning_of(s)};
}

LiquidSettings checked(const LiquidSettings& s) {
  if (!(s.spacing_m > 0 && s.spacing_m < 1e3F)) refuse("spacing_m", s.spacing_m, "> 0");
  if (!(s.density_kg_m3 > 0)) refuse("density_kg_m3", s.density_kg_m3, "> 0");
  if (!(s.viscosity_Pa_s >= 0)) refuse("viscosity_Pa_s", s.viscosity_Pa_s, ">= 0");
  if (s.carreau) {
    const Carreau& c = *s.carreau;
    if (!(c.zero_shear_Pa_s >= s.viscosity_Pa_s))
      refuse("zero_shear_Pa_s", c.zero_shear_Pa_s,
             "at least viscosity_Pa_s, which is left at high shear rates");
    if (!(c.relaxation_s >= 0)) refuse("relaxation_s", c.relaxation_s, ">= 0");
    if (!(c.index > 0 && c.index <= 1)) refuse("index", c.index, "> 0 and <= 1");
  }
  if (!(s.surface_tension_N_m >= 0)) refuse("surface_tension_N_m", s.surface_tension_N_m, ">= 0");
  if (!(s.contact_angle_deg >= 0 && s.contact_angle_deg <= 180))
    refuse("contact_angle_deg", s.contact_angle_deg, "from 0 to 180");
  if (!(s.max_speed_m_s > 0)) refuse("max_speed_m_s", s.max_speed_m_s, "> 0");
  if (!(s.artificial_viscosity >= 0)) refuse("artificial_viscosity", s.artificial_viscosity, ">= 0");
  if (s.iterations < 1) refuse("iterations", static_cast<float>(s.iterations), "> 0");
  if (s.max_particles <= 0) refuse("max_particles", static_cast<float>(s.max_particles), "> 0");
  if (s.max_particles > kMostLiquidParticles)
    throw Error("liquid: max_particles is " + std::to_string(s.max_particles) + ", must be at most " +
                std::to_string(kMostLiquidParticles) + ": longer lists of neighbours can't be indexed");
  const Vec3f edge = s.box_m.extent();
  const float least = std::min({edge.x, edge.y, edge.z});
  if (!(least >= s.spacing_m)) refuse("the shortest edge of box_m", least, "at least the spacing");
  for (const LiquidEmitter& e : s.emitters) {
    if (!(e.speed_m_s > 0)) refuse("speed_m_s of an emitter", e.speed_m_s, "> 0");
    if (!(e.radius_m > 0)) refuse("radius_m of an emitter", e.radius_m, "> 0");
    if (!(length(e.direction) > 0)) refuse("the length of an emitter's direction", 0, "> 0");
  }
  return s;
}

}  // namespace tactus
