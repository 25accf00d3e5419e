#pragma once
/// Damping of bodies whose material gives none: so much that they stand where Coulomb says that they do.
#include "tactus/sim/scene.h"
#include "tactus/tissue/flsm/flsm.h"
#include "tactus/tissue/tled/elastic_material.h"

namespace tactus {

/// Part of critical damping at the slowest sway. Elastic bodies that slide with friction flutter below 0.04:
/// pressure, friction and sway drive one another. Soft tissue has loss factors, twice this part, of 0.1
/// to 0.3.
inline constexpr double kSwayDamping = 0.145;

/// How fast a cube of this volume and material sways that stands on one face [1/s].
double slowest_sway_per_s(const MaterialDescription& material, double volume_m3);

/// Elements: as `damping` says. Without it, a stress is added that fades: it damps the slowest sway by
/// kSwayDamping, at any step. Viscous elements that did as much would take steps that are shorter by 2 z, z
/// being 9.7 kSwayDamping times the cubes across at nu = 0.45: by 14 where these are five.
void set_damping(TledOptions& options, const MaterialDescription& material, double volume_m3);

/// Shape matching: as `damping` says. Without it, by kSwayDamping, or as much as its steps allow.
void set_damping(FlsmMaterial& matched, const MaterialDescription& material, double volume_m3);

}  // namespace tactus
