#pragma once
/// Small vectors, matrices and rotations, for host and device. Plain data; component-wise arithmetic.
#include "tactus/base/math.h"

namespace tactus {

template <class T>
struct Vec2 {
  T x{}, y{};
  TACTUS_HD friend constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  TACTUS_HD friend constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  TACTUS_HD friend constexpr Vec2 operator*(T s, Vec2 a) { return {s * a.x, s * a.y}; }
  friend constexpr bool operator==(const Vec2&, const Vec2&) = default;
};

template <class T>
struct Vec3 {
  T x{}, y{}, z{};
  TACTUS_HD constexpr T& operator[](int i) { return i == 0 ? x : (i == 1 ? y : z); }
  TACTUS_HD constexpr const T& operator[](int i) const { return i == 0 ? x : (i == 1 ? y : z); }
  TACTUS_HD constexpr Vec3& operator+=(Vec3 b) { return *this = *this + b; }
  TACTUS_HD constexpr Vec3& operator-=(Vec3 b) { return *this = *this - b; }
  TACTUS_HD constexpr Vec3& operator*=(T s) { return *this = s * *this; }
  TACTUS_HD friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  TACTUS_HD friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  TACTUS_HD friend constexpr Vec3 operator-(Vec3 a) { return {-a.x, -a.y, -a.z}; }
  TACTUS_HD friend constexpr Vec3 operator*(T s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
  TACTUS_HD friend constexpr Vec3 operator*(Vec3 a, T s) { return s * a; }
  TACTUS_HD friend constexpr Vec3 operator/(Vec3 a, T s) { return {a.x / s, a.y / s, a.z / s}; }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
};

using Vec2f = Vec2<float>;
using Vec2d = Vec2<double>;
using Vec2i = Vec2<Index>;
using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;
using Vec3i = Vec3<Index>;

template <class T>
TACTUS_HD constexpr T dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
TACTUS_HD constexpr Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
TACTUS_HD T length(Vec3<T> a) {
  return tactus::sqrt(dot(a, a));
}
/// Unit vector along a; `fallback` where a is (nearly) zero.
template <class T>
TACTUS_HD Vec3<T> normalized(Vec3<T> a, Vec3<T> fallback = {}) {
  const T l = length(a);
  return l > T(1e-30) ? (T(1) / l) * a : fallback;
}
template <class T>
TACTUS_HD constexpr Vec3<T> min(Vec3<T> a, Vec3<T> b) {
  return {min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)};
}
template <class T>
TACTUS_HD constexpr Vec3<T> max(Vec3<T> a, Vec3<T> b) {
  return {max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)};
}
template <class U, class T>
TACTUS_HD constexpr Vec3<U> vec_cast(Vec3<T> a) {
  return {static_cast<U>(a.x), static_cast<U>(a.y), static_cast<U>(a.z)};
}

/// 3x3 matrix, rows.
template <class T>
struct Mat3 {
  Vec3<T> row[3];
  /// Not from `{}`: a rotation that was left out would be zero in silence. Say identity() or zero().
  explicit Mat3() = default;
  TACTUS_HD constexpr Mat3(const Vec3<T> (&rows)[3]) : row{rows[0], rows[1], rows[2]} {}
  TACTUS_HD static constexpr Mat3 identity() { return {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}; }
  TACTUS_HD static constexpr Mat3 zero() { return {{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}}; }
  TACTUS_HD constexpr T& operator()(int i, int j) { return row[i][j]; }
  TACTUS_HD constexpr const T& operator()(int i, int j) const { return row[i][j]; }
  TACTUS_HD constexpr Vec3<T> column(int j) const { return {row[0][j], row[1][j], row[2][j]}; }
  TACTUS_HD friend constexpr Vec3<T> operator*(const Mat3& m, Vec3<T> v) {
    return {dot(m.row[0], v), dot(m.row[1], v), dot(m.row[2], v)};
  }
  TACTUS_HD friend constexpr Mat3 operator*(const Mat3& a, const Mat3& b) {
    Mat3 r = zero();
    for (int i = 0; i < 3; ++i)
      r.row[i] = a.row[i].x * b.row[0] + a.row[i].y * b.row[1] + a.row[i].z * b.row[2];
    return r;
  }
  TACTUS_HD friend constexpr Mat3 operator+(const Mat3& a, const Mat3& b) {
    return {{a.row[0] + b.row[0], a.row[1] + b.row[1], a.row[2] + b.row[2]}};
  }
  TACTUS_HD friend constexpr Mat3 operator-(const Mat3& a, const Mat3& b) {
    return {{a.row[0] - b.row[0], a.row[1] - b.row[1], a.row[2] - b.row[2]}};
  }
  TACTUS_HD friend constexpr Mat3 operator*(T s, const Mat3& a) {
    return {{s * a.row[0], s * a.row[1], s * a.row[2]}};
  }
  friend constexpr bool operator==(const Mat3&, const Mat3&) = default;
};
using Mat3f = Mat3<float>;
using Mat3d = Mat3<double>;

template <class T>
TACTUS_HD constexpr Mat3<T> transpose(const Mat3<T>& m) {
  return {{m.column(0), m.column(1), m.column(2)}};
}
template <class T>
TACTUS_HD constexpr T determinant(const Mat3<T>& m) {
  return dot(m.row[0], cross(m.row[1], m.row[2]));
}
template <class T>
TACTUS_HD constexpr T trace(const Mat3<T>& m) {
  return m.row[0].x + m.row[1].y + m.row[2].z;
}
/// a b^T
template <class T>
TACTUS_HD constexpr Mat3<T> outer(Vec3<T> a, Vec3<T> b) {
  return {{a.x * b, a.y * b, a.z * b}};
}
/// Inverse; the caller makes sure that m is regular.
template <class T>
TACTUS_HD constexpr Mat3<T> inverse(const Mat3<T>& m) {
  const T s = T(1) / determinant(m);
  return transpose(
      Mat3<T>{{s * cross(m.row[1], m.row[2]), s * cross(m.row[2], m.row[0]), s * cross(m.row[0], m.row[1])}});
}
template <class U, class T>
TACTUS_HD constexpr Mat3<U> mat_cast(const Mat3<T>& m) {
  return {{vec_cast<U>(m.row[0]), vec_cast<U>(m.row[1]), vec_cast<U>(m.row[2])}};
}

/// Unit quaternion w + xi + yj + zk.
template <class T>
struct Quat {
  T w{1}, x{}, y{}, z{};
  TACTUS_HD friend constexpr Quat operator*(const Quat& a, const Quat& b) {
    return {a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
  }
  friend constexpr bool operator==(const Quat&, const Quat&) = default;
};
using Quatf = Quat<float>;

template <class T>
TACTUS_HD Quat<T> normalized(const Quat<T>& q) {
  const T s = T(1) / tactus::sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
  return {s * q.w, s * q.x, s * q.y, s * q.z};
}
template <class T>
TACTUS_HD constexpr Mat3<T> rotation_matrix(const Quat<T>& q) {
  const T x2 = q.x + q.x, y2 = q.y + q.y, z2 = q.z + q.z;
  return {{{1 - (q.y * y2 + q.z * z2), q.x * y2 - q.w * z2, q.x * z2 + q.w * y2},
           {q.x * y2 + q.w * z2, 1 - (q.x * x2 + q.z * z2), q.y * z2 - q.w * x2},
           {q.x * z2 - q.w * y2, q.y * z2 + q.w * x2, 1 - (q.x * x2 + q.y * y2)}}};
}
/// Rotation by `angle_rad` about the unit vector `axis`.
TACTUS_HD inline Quatf axis_angle(Vec3f axis, float angle_rad) {
  const SinCos h = sin_cos(0.5F * angle_rad);
  return {h.cos, h.sin * axis.x, h.sin * axis.y, h.sin * axis.z};
}

/// Rigid motion p -> R p + t. `T_a_b` maps points of frame b to frame a.
template <class T>
struct Rigid {
  Mat3<T> R = Mat3<T>::identity();
  Vec3<T> t{};
  TACTUS_HD friend constexpr Vec3<T> operator*(const Rigid& m, Vec3<T> p) { return m.R * p + m.t; }
  TACTUS_HD friend constexpr Rigid operator*(const Rigid& a, const Rigid& b) {
    return {a.R * b.R, a.R * b.t + a.t};
  }
};
using Rigidf = Rigid<float>;
using Rigidd = Rigid<double>;
template <class T>
TACTUS_HD constexpr Rigid<T> inverse(const Rigid<T>& m) {
  const Mat3<T> Rt = transpose(m.R);
  return {Rt, -(Rt * m.t)};
}

/// Axis-aligned box [min, max].
struct Box3f {
  Vec3f min{}, max{};
  TACTUS_HD constexpr Vec3f extent() const { return max - min; }
  TACTUS_HD constexpr Vec3f center() const { return 0.5F * (min + max); }
};

}  // namespace tactus
