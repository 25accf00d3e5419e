#pragma once
/// Rigid motion between point sets on the host.
#include <span>

#include "tactus/base/vec.h"

namespace tactus {

struct RigidFit {
  Rigidd T_b_a;      ///< maps points of a onto those of b
  double rms_m = 0;  ///< root of the weighted mean square distance left over
};

/// The rotation and translation that bring a_m onto b_m with the smallest weighted squared distance, by the
/// eigenvector of Horn's quaternion matrix (Horn 1987). Points on one line leave the rotation about it at the
/// smallest possible turn found by the eigenvector; a single point gives the translation only.
/// @param weights one per pair, >= 0, or empty for 1
/// @throws Error when the sizes differ, there is no pair or the weights sum to 0.
RigidFit fit_rigid(std::span<const Vec3d> a_m, std::span<const Vec3d> b_m,
                   std::span<const double> weights = {});

}  // namespace tactus
