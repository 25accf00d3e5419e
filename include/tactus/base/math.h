#pragma once
/// Scalar maths with the same bits on every device: + - * / sqrt floor fma and functions built from them.
/// Kernels use only these (no libm: its last bits differ between machines).
#include <bit>
#include <cmath>

#include "tactus/base/hd.h"

namespace tactus {

inline constexpr float kPi = 3.14159265358979323846F;

template <class T>
TACTUS_HD constexpr T min(T a, T b) {
  return b < a ? b : a;
}
template <class T>
TACTUS_HD constexpr T max(T a, T b) {
  return a < b ? b : a;
}
template <class T>
TACTUS_HD constexpr T clamp(T x, T low, T high) {
  return min(max(x, low), high);
}
template <class T>
TACTUS_HD constexpr T sqr(T x) {
  return x * x;
}
TACTUS_HD constexpr Index ceil_div(Index a, Index b) { return (a + b - 1) / b; }

TACTUS_HD inline float abs(float x) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) & 0x7fffffffU);
}
TACTUS_HD inline double abs(double x) { return x < 0 ? -x : x; }

/// a*b + c, rounded once. The only fused operation in the program (contraction is off).
TACTUS_HD inline float fma(float a, float b, float c) { return __builtin_fmaf(a, b, c); }
TACTUS_HD inline double fma(double a, double b, double c) { return __builtin_fma(a, b, c); }

TACTUS_HD inline float sqrt(float x) {
#if defined(__CUDA_ARCH__)
  return __fsqrt_rn(x);
#else
  return __builtin_sqrtf(x);
#endif
}
TACTUS_HD inline double sqrt(double x) { return ::sqrt(x); }

/// Largest integer <= x, for |x| < 2^31.
TACTUS_HD inline Index floor_to_int(float x) {
  const Index i = static_cast<Index>(x);
  return i - (static_cast<float>(i) > x ? 1 : 0);
}

/// sin and cos of x [rad], |x| <= 1e4: two-step reduction by pi/2, then minimax-free Taylor polynomials of
/// degree 9 and 10 on [-pi/4, pi/4] (error < 2e-7).
struct SinCos {
  float sin, cos;
};
TACTUS_HD inline SinCos sin_cos(float x) {
  const float k = static_cast<float>(floor_to_int(x * 0.636619772F + 0.5F));
  const float r = fma(-k, 7.5497894159e-8F, fma(-k, 1.57079625129699707031F, x));
  const float r2 = r * r;
  const float s = fma(
      r * r2, fma(r2, fma(r2, fma(r2, 2.75573192e-6F, -1.98412698e-4F), 8.33333333e-3F), -1.66666667e-1F), r);
  const float c =
      fma(r2,
          fma(r2, fma(r2, fma(r2, fma(r2, -2.75573192e-7F, 2.48015873e-5F), -1.38888889e-3F), 4.16666667e-2F),
              -0.5F),
          1.F);
  const int q = static_cast<int>(k) & 3;
  const float a = (q & 1) ? c : s, b = (q & 1) ? s : c;
  return {(q & 2) ? -a : a, ((q + 1) & 2) ? -b : b};
}

/// e^x for |x| <= 87 (error < 2 ulp).
TACTUS_HD inline float exp(float x) {
  const float k = static_cast<float>(floor_to_int(clamp(x, -87.F, 87.F) * 1.44269504F + 0.5F));
  const float r = fma(-k, -2.12194440e-4F, fma(-k, 0.693359375F, clamp(x, -87.F, 87.F)));
  const float p = fma(
      r, fma(r, fma(r, fma(r, fma(r, 1.38888889e-3F, 8.33333333e-3F), 4.16666667e-2F), 1.66666667e-1F), 0.5F),
      1.F);
  const float scale = std::bit_cast<float>(static_cast<std::uint32_t>(static_cast<int>(k) + 127) << 23);
  return fma(r, p, 1.F) * scale;
}

/// The natural logarithm of a positive number that is not denormal (error < 1e-7 (1 + |log x|)).
TACTUS_HD inline float log(float x) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(x);
  // x = 2^k m with m from 1/sqrt(2) to sqrt(2); log m = 2 artanh((m - 1) / (m + 1)).
  const int k = static_cast<int>(bits - 0x3f3504f3U) >> 23;
  const float m = std::bit_cast<float>(bits - (static_cast<std::uint32_t>(k) << 23));
  const float a = (m - 1) / (m + 1), a2 = a * a;
  const float series = a * fma(a2, fma(a2, fma(a2, fma(a2, 2.F / 9, 2.F / 7), 2.F / 5), 2.F / 3), 2.F);
  return fma(static_cast<float>(k), 0.69314718F, series);
}

}  // namespace tactus
