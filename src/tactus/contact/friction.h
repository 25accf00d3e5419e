#pragma once
/// Coulomb's law for one touching point.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// A point remembers its contact for so many corrections, less one: a resting point leaves the surface for a
/// substep now and then, by rounding or because it swings, and must not creep with each time.
inline constexpr Index kLingering = 8;

/// State of friction at a touching point, from its last corrections.
///
/// A soft surface swings: a resting point presses more in one correction than in the next, while the shear
/// that it bears stays. Coulomb's law for each correction alone would let it slip whenever it presses little.
/// So normal impulses that friction hasn't used count for about kLingering corrections, and the way that the
/// anchor holds the point follows the mean depth over as many. Over a time friction takes mu times the normal
/// impulse, and no more.
struct FrictionMemory {
  float unused_m_s = 0;  ///< mu times normal impulses per mass, less the friction so far
  float depth_m = 0;     ///< mean

  static constexpr float kShare = 1.F / kLingering;

  TACTUS_HD static FrictionMemory begin(float depth_m) { return {0, depth_m}; }
  TACTUS_HD void press(float new_depth_m) { depth_m += kShare * (new_depth_m - depth_m); }

  /// Change of the velocity of a point that moves by `rel` relative to the surface that it touches, whose
  /// normal is n. The normal part of an approach is reflected with restitution e; friction takes as much of
  /// the tangential part as it may.
  TACTUS_HD Vec3f velocity_correction_m_s(Vec3f rel, Vec3f n, float restitution, float friction) {
    const float along = dot(rel, n), bounce = along < 0.F ? -(1.F + restitution) * along : 0.F;
    const Vec3f slide = rel - along * n;
    const float speed = length(slide), most = friction * bounce + (1.F - kShare) * unused_m_s;
    unused_m_s = most > speed ? most - speed : 0.F;
    return bounce * n - (speed > most ? most / speed : 1.F) * slide;
  }
};

}  // namespace tactus
