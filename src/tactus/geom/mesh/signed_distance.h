#pragma once
/// Signed distance functions on the host, for one point (T = float) or eight at once (T = Float8).
/// All are 1-Lipschitz, negative inside, and have the same bits for both types. Lengths in metres.
#if defined(__AVX__)
#include <immintrin.h>
#endif

#include "tactus/base/vec.h"

namespace tactus {

/// Eight floats in one register; arithmetic lane by lane.
struct Float8 {
  using Lanes = float __attribute__((vector_size(32)));
  using Flags = std::int32_t __attribute__((vector_size(32)));
  Lanes v;

  Float8() : v{0, 0, 0, 0, 0, 0, 0, 0} {}
  Float8(float s) : v{s, s, s, s, s, s, s, s} {}  // NOLINT(google-explicit-constructor): a scalar is a vector
  explicit Float8(const Lanes& lanes) : v(lanes) {}
  float operator[](int lane) const { return v[lane]; }
  void set(int lane, float x) { v[lane] = x; }

  friend Float8 operator+(const Float8& a, const Float8& b) { return Float8(Lanes(a.v + b.v)); }
  friend Float8 operator-(const Float8& a, const Float8& b) { return Float8(Lanes(a.v - b.v)); }
  friend Float8 operator*(const Float8& a, const Float8& b) { return Float8(Lanes(a.v * b.v)); }
  friend Float8 operator/(const Float8& a, const Float8& b) { return Float8(Lanes(a.v / b.v)); }
  friend Float8 operator-(const Float8& a) { return Float8(Lanes(-a.v)); }
};

/// Bit i of the result: is lane i of `a` less than that of `b`?
inline unsigned less_bits(const Float8& a, const Float8& b) {
  const Float8::Flags less = a.v < b.v;
#if defined(__AVX__)
  return static_cast<unsigned>(_mm256_movemask_ps(std::bit_cast<__m256>(less)));
#else
  unsigned bits = 0;
  for (int i = 0; i < 8; ++i) bits |= static_cast<unsigned>(less[i] & 1) << i;
  return bits;
#endif
}
/// The same question for one point: 0 or 1.
inline unsigned less_bits(float a, float b) { return a < b ? 1U : 0U; }

inline Float8 min(const Float8& a, const Float8& b) { return Float8(Float8::Lanes(b.v < a.v ? b.v : a.v)); }
inline Float8 max(const Float8& a, const Float8& b) { return Float8(Float8::Lanes(a.v < b.v ? b.v : a.v)); }
inline Float8 abs(const Float8& a) { return max(a, -a); }
inline Float8 sqrt(const Float8& a) {
#if defined(__AVX__)
  return Float8(std::bit_cast<Float8::Lanes>(_mm256_sqrt_ps(std::bit_cast<__m256>(a.v))));
#else
  Float8 r;
  for (int i = 0; i < 8; ++i) r.v[i] = __builtin_sqrtf(a.v[i]);
  return r;
#endif
}
/// `a` in the lanes whose bit is set, else `b`.
inline Float8 select(unsigned bits, const Float8& a, const Float8& b) {
  constexpr Float8::Flags kLaneBit = {1, 2, 4, 8, 16, 32, 64, 128};
  const auto all = static_cast<std::int32_t>(bits);
  const Float8::Flags chosen = (Float8::Flags{all, all, all, all, all, all, all, all} & kLaneBit) != 0;
  return Float8(Float8::Lanes(chosen ? a.v : b.v));
}

/// Union of two bodies whose seam is filled within `blend_m`; equal to min(a, b) where |a - b| >= blend_m.
/// Lowers the minimum by at most blend_m / 4. `inverse_4_blend` = 1 / (4 blend_m), or 0 for a sharp seam.
template <class T>
T smooth_min(const T& a, const T& b, float blend_m, float inverse_4_blend) {
  const T h = max(T(blend_m) - abs(a - b), T(0.F));
  return min(a, b) - h * h * T(inverse_4_blend);
}

/// Intersection of two bodies whose edge is rounded within `blend_m`; equal to max(a, b) where
/// |a - b| >= blend_m. Raises the maximum by at most blend_m / 4.
template <class T>
T smooth_max(const T& a, const T& b, float blend_m, float inverse_4_blend) {
  return -smooth_min(-a, -b, blend_m, inverse_4_blend);
}

/// The hull of two spheres: radius `radius_a_m` around `a_m`, another one `length_m` further along `axis`.
struct RoundCone {
  Vec3f a_m;
  Vec3f axis;  ///< unit
  float length_m = 0, radius_a_m = 0;
  float slope = 0;  ///< loss of radius per length, in (-1, 1)
  float shift = 0;  ///< slope / sqrt(1 - slope^2)

  /// Distance: from the sphere on the axis whose surface is nearest.
  template <class T>
  T distance_m(const Vec3<T>& p_m) const {
    const Vec3<T> q{p_m.x - T(a_m.x), p_m.y - T(a_m.y), p_m.z - T(a_m.z)};
    const T y = q.x * T(axis.x) + q.y * T(axis.y) + q.z * T(axis.z);
    const Vec3<T> w{q.x - y * T(axis.x), q.y - y * T(axis.y), q.z - y * T(axis.z)};
    const T x2 = dot(w, w);
    const T s = min(max(y - sqrt(x2) * T(shift), T(0.F)), T(length_m));
    return sqrt(x2 + (y - s) * (y - s)) - (T(radius_a_m) - s * T(slope));
  }
};

/// The round cone between two spheres; neither may contain the other (then: the larger one alone).
inline RoundCone make_round_cone(Vec3f a_m, Vec3f b_m, float radius_a_m, float radius_b_m) {
  const float l = length(b_m - a_m);
  if (l <= 1.001F * abs(radius_a_m - radius_b_m) || l < 1e-9F) {
    return {radius_a_m < radius_b_m ? b_m : a_m, {0, 1, 0}, 0, max(radius_a_m, radius_b_m), 0, 0};
  }
  const float slope = (radius_a_m - radius_b_m) / l;
  return {a_m, (1.F / l) * (b_m - a_m), l, radius_a_m, slope, slope / sqrt(1.F - slope * slope)};
}

/// The side of a plane to which `normal` does not point: dot(normal, p) <= offset_m.
struct HalfSpace {
  Vec3f normal;  ///< unit
  float offset_m = 0;

  template <class T>
  T distance_m(const Vec3<T>& p_m) const {
    return p_m.x * T(normal.x) + p_m.y * T(normal.y) + p_m.z * T(normal.z) - T(offset_m);
  }
};

/// A thick spherical wall around `center_m`.
struct SphereShell {
  Vec3f center_m;
  float radius_m = 0;  ///< of the middle of the wall
  float half_thickness_m = 0;

  template <class T>
  T distance_m(const Vec3<T>& p_m) const {
    const Vec3<T> q{p_m.x - T(center_m.x), p_m.y - T(center_m.y), p_m.z - T(center_m.z)};
    return abs(sqrt(dot(q, q)) - T(radius_m)) - T(half_thickness_m);
  }
};

}  // namespace tactus
