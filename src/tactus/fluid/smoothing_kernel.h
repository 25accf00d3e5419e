#pragma once
/// The smoothing kernel, and its substitute behind a wall.
#include "tactus/base/math.h"

namespace tactus {

/// Cubic spline (Monaghan & Lattanzio 1985) whose smoothing length is the spacing d of the particles, so it
/// ends at 2 d:
///
///   W(r) = ((2 - q)+^3 - 4 (1 - q)+^3) / (4 pi d^3),    q = r / d.
///
/// On a cubic lattice of spacing d, sum W d^3 = 1.0001 with 33 particles. (Wendland's C2 kernel of the same
/// support gives 1.034: its particles would have to be lighter than the liquid that they stand for.)
///
/// Beside a wall, a particle lacks the neighbours behind it. Their substitute, `fill`, is a share of the
/// density whose slope is the force, so energy is kept. It must do two things for a layer half a spacing from
/// the wall: make up for the missing layer, fill(d/2) = 0.1497, and balance the other side's pressure. There
/// every pair brings p_i / rho_i^2 + p_j / rho_j^2, but a wall has no pressure of its own, so its slope is
/// twice the missing layer's: -1.0200 / d. (With the plain integral of the kernel over the space behind the
/// plane, the layer is pressed to 0.2 d from the wall, at four times the pressure.) A cubic has both:
///
///   fill(s) = 1.4583 (1 - s / (0.9402 d))+^3.
struct SmoothingKernel {
  float inverse_d_1_m = 1;  ///< 1 / d

  TACTUS_HD float reach_m() const { return 2.F / inverse_d_1_m; }
  /// W [1/m^3] = scale() shape(q).
  TACTUS_HD float scale_1_m3() const { return inverse_d_1_m * inverse_d_1_m * inverse_d_1_m / (4 * kPi); }
  TACTUS_HD static float shape(float q) {
    const float t = max(0.F, 2 - q), u = max(0.F, 1 - q);
    return t * t * t - 4 * (u * u * u);
  }
  /// -dW/dr / r [1/m^5] = slope_scale() slope(q, 1/q).
  TACTUS_HD float slope_scale_1_m5() const { return 3 * scale_1_m3() * inverse_d_1_m * inverse_d_1_m; }
  TACTUS_HD static float slope(float q, float inverse_q) {
    const float t = max(0.F, 2 - q), u = max(0.F, 1 - q);
    return (t * t - 4 * (u * u)) * inverse_q;
  }

  /// Integral of W over a plane at distance s: 2 pi int_s^2d W r dr. (Rings around the normal have the area
  /// r dr dphi, so it is a polynomial.)
  TACTUS_HD float area_1_m(float s_m) const { return inverse_d_1_m * shape_area(abs(s_m * inverse_d_1_m)); }

  TACTUS_HD float fill(float s_m) const {
    const float u = beside(s_m);
    return kFill * (u * u * u);
  }
  /// Minus the slope of `fill`.
  TACTUS_HD float fill_slope_1_m(float s_m) const {
    const float u = beside(s_m);
    return 3 * kFill / kFillEnd * inverse_d_1_m * (u * u);
  }
  /// Share of the space behind one plane that is behind another, too, at the signed distance s from the
  /// particle: the share of the kernel there. Where `fill`, which knows the lattice, is less, it is `fill`;
  /// and as both sides of a plane are all, share(-s) = 1 - share(s). Beside an edge of a lattice of which a
  /// quarter is missing, the row half a spacing inside of it is then pushed by 0.867 / d (the lattice: 0.87),
  /// and that outside by 0.153 / d (0.16): together as one in the middle of a face.
  TACTUS_HD float share(float s_m) const {
    const float beyond = min(fill(abs(s_m)), shape_volume(abs(s_m * inverse_d_1_m)));
    return s_m < 0.F ? 1.F - beyond : beyond;
  }
  /// Minus the slope of `share`.
  TACTUS_HD float share_slope_1_m(float s_m) const {
    const float s = abs(s_m);
    return fill(s) < shape_volume(s * inverse_d_1_m) ? fill_slope_1_m(s) : area_1_m(s);
  }

 private:
  // int_s^2 (2 - q)^3 q dq = (2 - s)^4 / 2 - (2 - s)^5 / 5; likewise with 1.
  TACTUS_HD static float shape_area(float s) {
    const float t = max(0.F, 2 - s), u = max(0.F, 1 - s), t2 = t * t, u2 = u * u;
    return 0.5F * (t2 * t2 * (0.5F - 0.2F * t) - 4 * (u2 * u2 * (0.25F - 0.2F * u)));
  }
  // int_s^2 shape_area.
  TACTUS_HD static float shape_volume(float s) {
    const float t = max(0.F, 2 - s), u = max(0.F, 1 - s), t2 = t * t, u2 = u * u;
    return 0.5F * (t2 * t2 * t * (0.1F - t / 30) - 4 * (u2 * u2 * u * (0.05F - u / 30)));
  }
  static constexpr float kFillEnd = 0.940232F, kFill = 1.458279F;
  TACTUS_HD float beside(float s_m) const { return max(0.F, 1 - s_m * inverse_d_1_m / kFillEnd); }
};

}  // namespace tactus
