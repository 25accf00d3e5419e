#pragma once
/// Viscosity between particles and at walls, and blood that thins when it is sheared.
#include "tactus/base/math.h"

namespace tactus {

/// Viscous forces act along the line between two particles, so angular momentum is conserved and rigid
/// rotation is free (Cleary 1998, Monaghan 2005):
///
///   a_i = sum_j V 10 nu G(r) (v_j - v_i) . x_ij / r^2 x_ij.
///
/// 10 = 2 (dimensions + 2). Any weight with the integral of G r^2 equal to 3 gives nu (lap v + 2 grad div v).
/// It is usually -W'/r. With only 26 neighbours, that of the cubic spline gives 0.71 nu to a cubic lattice
/// that is sheared along its axes, and 1.48 nu at 45 degrees. This weight reaches farther out, and gives 1.02
/// and 1.16 there, 0.96 and 0.96 to a body-centred lattice, 0.89 and 0.98 to a face-centred one:
///
///   G(r) = 63 / (128 pi d^5) q (2 - q)+^2,  q = r / d.
struct ViscousKernel {
  /// Factor of SmoothingKernel::slope_scale_1_m5() in G = scale * kWeight * q (2 - q)^2.
  static constexpr float kWeight = 21.F / 32;

  /// Behind a wall at distance s the velocity goes on linearly, so liquid doesn't slip. With the velocity u
  /// of a particle along the wall and relative to it, the integral behind the wall is -nu friction(s / d) /
  /// (s d) u. The integral of friction from 0 to 2 is 1, so layers of any liquid bear the stress mu du/ds.
  TACTUS_HD static float friction(float s) {
    const float t = max(0.F, 2 - s), t2 = t * t;
    return (3.F / 128) * (t2 * t2 * t) * fma(t, fma(4, t, -21), 28);
  }
  /// Where squares of shear rates are summed, the space behind the wall has this share of the weight that
  /// sums over neighbours have, 1/2 at s = 0: -int_s^2 x friction'(x) dx / 2.
  TACTUS_HD static float behind(float s) {
    const float t = max(0.F, 2 - s), t2 = t * t;
    return 0.5F * (s * friction(s) + (1.F / 256) * (t2 * t2 * t2) * fma(t, fma(3, t, -18), 28));
  }
};

/// Kinematic viscosity at a shear rate (Carreau 1972):
///
///   nu = nu_inf + (nu_0 - nu_inf) (1 + (lambda rate)^2)^((n - 1) / 2).
struct CarreauLaw {
  float zero_m2_s = 0, infinite_m2_s = 0, relaxation_s = 0, index = 1;
  TACTUS_HD float at(float rate2_1_s2) const {
    const float x = min(sqr(relaxation_s) * rate2_1_s2, 1e30F);
    return infinite_m2_s + (zero_m2_s - infinite_m2_s) * exp(0.5F * (index - 1) * log(1.F + x));
  }
};

}  // namespace tactus
