#include "tactus/sim/body/default_damping.h"

#include <cmath>

namespace tactus {
namespace {

/// Part of critical damping of the fastest mode, besides.
constexpr double kFastDamping = 0.1;

/// Stress that is added, of what lasts, and its time over that of the slowest sway, 1 / omega: its loss
/// factor is share w / (1 + w^2 (1 + share)), w = omega time: 0.25 at the slowest sway, and most, 0.30,
/// at 1.9 times that. With a share of 0.5, blocks stand at a friction of 0.4 as well; at 0.3 long ones do
/// not.
constexpr double kShare = 0.8, kTime = 0.4;

}  // namespace

// Timoshenko's beam as long as it is wide: shear alone has pi/2 sqrt(0.85 G / rho) / L = 0.85 of
// sqrt(E / rho) / L with nu = 0.45, bending alone 3.516 / sqrt(12) = 1.02.
double slowest_sway_per_s(const MaterialDescription& material, double volume_m3) {
  return 0.65 * std::sqrt(material.young_modulus_pa / material.density_kg_m3) / std::cbrt(volume_m3);
}

void set_damping(TledOptions& options, const MaterialDescription& material, double volume_m3) {
  options.damping_ratio = static_cast<float>(material.damping.value_or(kFastDamping));
  if (material.damping || !material.relaxation.empty()) return;
  options.relaxation[0] = {.share = static_cast<float>(kShare),
                           .time_s = static_cast<float>(kTime / slowest_sway_per_s(material, volume_m3)),
                           .is_added = true};
}

void set_damping(FlsmMaterial& matched, const MaterialDescription& material, double volume_m3) {
  matched.damping_ratio = static_cast<float>(material.damping.value_or(kFastDamping));
  if (material.damping || material.kappa == Stiffness::paper) return;
  matched.damping_time_s = static_cast<float>(2 * kSwayDamping / slowest_sway_per_s(material, volume_m3));
}

}  // namespace tactus
