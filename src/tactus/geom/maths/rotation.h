#pragma once
/// Rotations as vectors (axis times angle, Rodrigues) and quaternions, in double, for the host.
#include <algorithm>
#include <cmath>

#include "tactus/base/vec.h"

namespace tactus {

/// Rotation by |v| about v.
inline Mat3d rotation_from_vector(Vec3d v) {
  const double angle = length(v);
  if (angle < 1e-12) return {{{1, -v.z, v.y}, {v.z, 1, -v.x}, {-v.y, v.x, 1}}};
  const Vec3d a = (1 / angle) * v;
  const double c = std::cos(angle), s = std::sin(angle);
  const Mat3d cross_a{{{0, -a.z, a.y}, {a.z, 0, -a.x}, {-a.y, a.x, 0}}};
  return c * Mat3d::identity() + s * cross_a + (1 - c) * outer(a, a);
}

/// w first; any length but 0.
inline Mat3d rotation_from_quaternion(double w, double x, double y, double z) {
  return rotation_matrix(normalized(Quat<double>{w, x, y, z}));
}

/// Unit quaternion with w >= 0, from the largest of the four squares so that nothing is divided by little.
inline Quat<double> quaternion_of(const Mat3d& R) {
  const double squares[4] = {1 + R(0, 0) + R(1, 1) + R(2, 2), 1 + R(0, 0) - R(1, 1) - R(2, 2),
                             1 - R(0, 0) + R(1, 1) - R(2, 2), 1 - R(0, 0) - R(1, 1) + R(2, 2)};
  Quat<double> q;
  switch (std::max_element(squares, squares + 4) - squares) {
    case 0:
      q = {squares[0], R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1)};
      break;
    case 1:
      q = {R(2, 1) - R(1, 2), squares[1], R(1, 0) + R(0, 1), R(0, 2) + R(2, 0)};
      break;
    case 2:
      q = {R(0, 2) - R(2, 0), R(1, 0) + R(0, 1), squares[2], R(2, 1) + R(1, 2)};
      break;
    default:
      q = {R(1, 0) - R(0, 1), R(0, 2) + R(2, 0), R(2, 1) + R(1, 2), squares[3]};
  }
  q = normalized(q);
  return q.w < 0 ? Quat<double>{-q.w, -q.x, -q.y, -q.z} : q;
}

/// The vector v of at most half a turn with rotation_from_vector(v) = R.
inline Vec3d vector_of_rotation(const Mat3d& R) {
  const Quat<double> q = quaternion_of(R);
  const Vec3d axis{q.x, q.y, q.z};
  const double s = length(axis);
  return s < 1e-12 ? 2.0 * axis : 2 * std::atan2(s, q.w) / s * axis;
}

}  // namespace tactus
