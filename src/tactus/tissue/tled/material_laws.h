#pragma once
/// Hyperelastic laws of soft tissue: the first Piola-Kirchhoff stress P(F) in kernels, the strain energy that
/// it derives from in double on the host. Adding a law: a struct here and a row in kLaws (material.cpp); see
/// docs/new_material.md.
///
/// Every law evaluates P = dW/dF without inverting F, and keeps pushing back through J = det F <= 0: 1/J is
/// replaced by 1/max(J, 0.1).
#include "tactus/base/vec.h"

namespace tactus {

/// A 3x3 matrix by columns (F.x = dx/dX), without indices: stays in registers.
struct GradientColumns {
  Vec3f x, y, z;
};

TACTUS_HD inline Vec3f fused_cross(Vec3f a, Vec3f b) {
  return {fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x))};
}

TACTUS_HD inline GradientColumns cofactor(const GradientColumns& F) {
  return {fused_cross(F.y, F.z), fused_cross(F.z, F.x), fused_cross(F.x, F.y)};
}

/// a F + s cof F.
TACTUS_HD inline GradientColumns combine(float a, const GradientColumns& F, float s,
                                         const GradientColumns& cof) {
  const auto column = [a, s](Vec3f f, Vec3f c) {
    return Vec3f{fma(a, f.x, s * c.x), fma(a, f.y, s * c.y), fma(a, f.z, s * c.z)};
  };
  return {column(F.x, cof.x), column(F.y, cof.y), column(F.z, cof.z)};
}

inline constexpr float kSmallestJ = 0.1F;

/// W = mu/2 (tr C - 3) - mu ln J + lambda/2 (J - 1)^2: S = mu (1 - C^-1) + lambda J (J - 1) C^-1 [P 5].
struct NeoHookean {
  float unused = 0;
  TACTUS_HD GradientColumns stress(const GradientColumns& F, float mu, float lambda) const {
    const GradientColumns cof = cofactor(F);
    const float J = dot(F.x, cof.x);
    return combine(mu, F, lambda * (J - 1.F) - mu / max(J, kSmallestJ), cof);
  }
};

/// 1/cbrt(x) for 0.05 <= x: three Newton steps from a quadratic seed; the same bits everywhere.
TACTUS_HD inline float inverse_cbrt(float x) {
  // The exponent divided by three, as bits: within 4 % over all floats; every step squares 1.5 times that.
  float r = std::bit_cast<float>(0x54a2fa8cU - std::bit_cast<std::uint32_t>(x) / 3U);
  for (int i = 0; i < 3; ++i) r = r * (1.3333333333F - 0.3333333333F * x * r * r * r);
  return r;
}

/// W = mu/2 (J^-2/3 tr C - 3) + K/2 (J - 1)^2 with K = lambda + 2/3 mu: volume and shape apart.
struct IsochoricNeoHookean {
  float unused = 0;
  TACTUS_HD GradientColumns stress(const GradientColumns& F, float mu, float lambda) const {
    const GradientColumns cof = cofactor(F);
    const float J = dot(F.x, cof.x), safe = max(J, kSmallestJ), r = inverse_cbrt(safe);
    const float shape = mu * r * r, trace = dot(F.x, F.x) + dot(F.y, F.y) + dot(F.z, F.z);
    const float bulk = fma(0.6666666667F, mu, lambda);
    return combine(shape, F, bulk * (J - 1.F) - shape * trace / (3.F * safe), cof);
  }
};

/// Neo-Hookean ground and fibres along a that resist stretch only: + c/2 max(a.Ca - 1, 0)^2, c = ratio mu.
struct TransverselyIsotropic {
  Vec3f fibre{1, 0, 0};  ///< a, unit, rest frame
  float ratio = 0;       ///< fibre stiffness over mu
  TACTUS_HD GradientColumns stress(const GradientColumns& F, float mu, float lambda) const {
    const GradientColumns ground = NeoHookean{}.stress(F, mu, lambda);
    const Vec3f Fa = fibre.x * F.x + fibre.y * F.y + fibre.z * F.z;
    const float pull = 2.F * ratio * mu * max(dot(Fa, Fa) - 1.F, 0.F);
    return {ground.x + (pull * fibre.x) * Fa, ground.y + (pull * fibre.y) * Fa,
            ground.z + (pull * fibre.z) * Fa};
  }
};

}  // namespace tactus
