#pragma once
/// The formulas of lens.h, for double and for numbers that carry derivatives. `k` holds the 14 coefficients
/// of Lens.
#include <cmath>

namespace tactus::lens_maths {

/// Turns (x, y) into the plane of a sensor that is tilted about x and then y.
template <class T>
void tilt(T tau_x, T tau_y, T& x, T& y) {
  using std::cos, std::sin;
  const T cx = cos(tau_x), sx = sin(tau_x), cy = cos(tau_y), sy = sin(tau_y);
  // R = R_y R_x; the point on the tilted plane, seen from the pinhole.
  const T u = cy * x + sy * sx * y - sy * cx, v = cx * y + sx, w = sy * x - cy * sx * y + cy * cx;
  const T r02 = -(sy * cx), r22 = cy * cx;  // and r12 = sx
  x = (r22 * u - r02 * w) / w;
  y = (r22 * v - sx * w) / w;
}

template <class T>
void distort_brown(const T* k, T& x, T& y) {
  const T r2 = x * x + y * y, r4 = r2 * r2;
  const T scale =
      (1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))) / (1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])));
  const T dx = x * scale + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x) + k[8] * r2 + k[9] * r4;
  const T dy = y * scale + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y + k[10] * r2 + k[11] * r4;
  x = dx;
  y = dy;
  if (k[12] != 0.0 || k[13] != 0.0) tilt(k[12], k[13], x, y);
}

template <class T>
T fisheye_theta(const T* k, const T& theta) {
  const T q = theta * theta;
  return theta * (1.0 + q * (k[0] + q * (k[1] + q * (k[2] + q * k[3]))));
}

template <class T>
void distort_fisheye(const T* k, T& x, T& y) {
  using std::atan, std::sqrt;
  const T r2 = x * x + y * y;
  if (r2 < 1e-24) return;  // theta / r is 1 - r^2 / 3
  const T r = sqrt(r2);
  const T scale = fisheye_theta(k, T(atan(r))) / r;
  x = x * scale;
  y = y * scale;
}

template <class T>
void distort_omni(const T* k, T& x, T& y) {
  using std::sqrt;
  const T scale = 1.0 / (1.0 + k[4] * sqrt(1.0 + x * x + y * y));
  x = x * scale;
  y = y * scale;
  const T zero(0.0),
      brown[14] = {k[0], k[1], k[2], k[3], zero, zero, zero, zero, zero, zero, zero, zero, zero, zero};
  distort_brown(brown, x, y);
  x = (1.0 + k[4]) * x;
  y = (1.0 + k[4]) * y;
}

template <class T>
void distort_eucm(const T* k, T& x, T& y) {
  using std::sqrt;
  const T scale = 1.0 / (k[0] * sqrt(k[1] * (x * x + y * y) + 1.0) + 1.0 - k[0]);
  x = x * scale;
  y = y * scale;
}

template <class T>
void distort_double_sphere(const T* k, T& x, T& y) {
  using std::sqrt;
  const T r2 = x * x + y * y, w = k[0] * sqrt(1.0 + r2) + 1.0;
  const T scale = (1.0 + k[0]) / (k[1] * sqrt(r2 + w * w) + (1.0 - k[1]) * w);
  x = x * scale;
  y = y * scale;
}

}  // namespace tactus::lens_maths
