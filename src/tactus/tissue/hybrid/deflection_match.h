#pragma once
/// The stiffness of shape matching from one deflection test [ours].
#include "tactus/tissue/hybrid/hybrid.h"

namespace tactus {

/// Work of a small weight on the nodes it moves, over its square: how much the body as it is held gives way
/// [m s^4 kg / m^2]. By steps with kinetic damping (Cundall 1982) until nothing moves. Synchronizes.
/// @param down direction of the weight, unit
double compliance(ExecContext& ctx, Hybrid& body, const CubeLattice& lattice, Vec3f down);

/// FlsmMaterial::stiffness_scale for which the body gives way to its weight as much as one of elements alone,
/// for small deflections: the formula for omega knows neither where the body is held nor Poisson's ratio.
/// Runs three tests of compliance. Within 1/4 to 4; 1 for a body without held nodes or without matched cubes.
/// Synchronizes.
/// @param model flsm.stiffness_scale is not used
float match_deflection(ExecContext& ctx, const BodyModel& model, Vec3f down = {0, -1, 0});

}  // namespace tactus
