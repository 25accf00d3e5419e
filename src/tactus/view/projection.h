#pragma once
/// 4x4 matrices as OpenGL wants them. Internal to view/.
#include <array>
#include <cmath>

#include "tactus/base/vec.h"

namespace tactus {

/// Column by column.
struct Mat4 {
  std::array<float, 16> m{};
  float& operator()(int row, int column) { return m[static_cast<std::size_t>(4 * column + row)]; }
  float operator()(int row, int column) const { return m[static_cast<std::size_t>(4 * column + row)]; }
  friend Mat4 operator*(const Mat4& a, const Mat4& b) {
    Mat4 r;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) {
        for (int k = 0; k < 4; ++k) r(i, j) += a(i, k) * b(k, j);
      }
    }
    return r;
  }
};

inline Mat4 to_mat4(const Rigidf& T) {
  Mat4 r;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) r(i, j) = T.R(i, j);
    r(i, 3) = T.t[i];
  }
  r(3, 3) = 1;
  return r;
}

inline Mat4 perspective(float fov_rad, float aspect, float near_m, float far_m) {
  Mat4 r;
  const float f = 1 / std::tan(0.5F * fov_rad);
  r(0, 0) = f / aspect;
  r(1, 1) = f;
  r(2, 2) = (far_m + near_m) / (near_m - far_m);
  r(2, 3) = 2 * far_m * near_m / (near_m - far_m);
  r(3, 2) = -1;
  return r;
}

/// With the tangents of the four edges, signed.
inline Mat4 off_axis(float left, float right, float down, float up, float near_m, float far_m) {
  Mat4 r;
  r(0, 0) = 2 / (right - left);
  r(1, 1) = 2 / (up - down);
  r(0, 2) = (right + left) / (right - left);
  r(1, 2) = (up + down) / (up - down);
  r(2, 2) = (far_m + near_m) / (near_m - far_m);
  r(2, 3) = 2 * far_m * near_m / (near_m - far_m);
  r(3, 2) = -1;
  return r;
}

/// Rows are right, up and -back of an image that is looked at along `toward`'s opposite.
inline Mat3f looking_along(Vec3f toward) {
  const Vec3f back = normalized(toward, {0, 1, 0});
  const Vec3f right = normalized(cross(std::abs(back.y) > 0.95F ? Vec3f{0, 0, 1} : Vec3f{0, 1, 0}, back));
  return {{right, cross(back, right), -back}};
}

/// Looks along -`toward` at a box of `half_m` around `center_m`; the image of the box is [-1, 1]^3.
inline Mat4 orthographic(Vec3f center_m, Vec3f toward, Vec3f half_m) {
  Mat3f R = looking_along(toward);
  for (int i = 0; i < 3; ++i) R.row[i] = (1 / half_m[i]) * R.row[i];
  return to_mat4({R, -(R * center_m)});
}

/// Clip space [-1, 1]^3 to texture space [0, 1]^3.
inline Mat4 clip_to_texture() {
  Mat4 r;
  for (int i = 0; i < 3; ++i) r(i, i) = r(i, 3) = 0.5F;
  r(3, 3) = 1;
  return r;
}

}  // namespace tactus
