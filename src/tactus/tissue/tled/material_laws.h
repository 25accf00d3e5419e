#pragma once
/// Hyperelastic laws of soft tissue. Adding one: a struct here and a row in TACTUS_MATERIAL_LAWS
/// (elastic_material.h); docs/new_material.md goes through it.
///
/// A law is
///   static Law of(const TledOptions&)        its constants of the whole body
///   stress(F, mu, lambda)                    first Piola-Kirchhoff stress P = dW/dF, for kernels; linear in
///                                            mu and lambda, of any sign
///   energy(F, mu, lambda)                    W [J/m^3], on the host in double; linear in mu and lambda
///   added_stiffness_Pa(mu)                   beyond 3 lambda + 2 mu, for the stable step
///   least_poisson                            below, its energy has no least value
/// P does not invert F, and keeps pushing back through J = det F <= 0: 1/J is replaced by 1/max(J, 0.1).
#include <algorithm>
#include <cmath>

#include "tactus/base/vec.h"
#include "tactus/tissue/tled/elastic_material.h"

namespace tactus {

/// A 3x3 matrix by columns (F.x = dx/dX), without indices: stays in registers.
struct GradientColumns {
  Vec3f x, y, z;
};

TACTUS_HD inline Vec3f fused_cross(Vec3f a, Vec3f b) {
  return {fma(a.y, b.z, -(a.z * b.y)), fma(a.z, b.x, -(a.x * b.z)), fma(a.x, b.y, -(a.y * b.x))};
}

TACTUS_HD inline float fused_dot(Vec3f a, Vec3f b) { return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x)); }

TACTUS_HD inline float trace_C(const GradientColumns& F) {
  const float xy = fma(F.y.z, F.y.z, fma(F.y.y, F.y.y, fma(F.y.x, F.y.x, fused_dot(F.x, F.x))));
  return xy + fused_dot(F.z, F.z);
}

/// a + s b.
TACTUS_HD inline Vec3f fused_add(Vec3f a, float s, Vec3f b) {
  return {fma(s, b.x, a.x), fma(s, b.y, a.y), fma(s, b.z, a.z)};
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

inline double trace_C(const Mat3d& F) {
  return dot(F.row[0], F.row[0]) + dot(F.row[1], F.row[1]) + dot(F.row[2], F.row[2]);
}

/// With lambda < 0 the last term falls without bound as J grows. W = mu/2 (tr C - 3) - mu ln J + lambda/2 (J
/// - 1)^2: S = mu (1 - C^-1) + lambda J (J - 1) C^-1 [P 5].
struct NeoHookean {
  float unused = 0;
  static constexpr float least_poisson = 0;
  static NeoHookean of(const TledOptions&) { return {}; }
  static float added_stiffness_Pa(float) { return 0; }
  TACTUS_HD GradientColumns stress(const GradientColumns& F, float mu, float lambda) const {
    const GradientColumns cof = cofactor(F);
    const float J = fused_dot(F.x, cof.x);
    return combine(mu, F, lambda * (J - 1.F) - mu / max(J, kSmallestJ), cof);
  }
  double energy(const Mat3d& F, double mu, double lambda) const {
    // ln J, continued by its tangent below the smallest J that stresses see.
    const double J = determinant(F), safe = std::max(J, double{kSmallestJ});
    return mu / 2 * (trace_C(F) - 3) - mu * (std::log(safe) + (J - safe) / safe) +
           lambda / 2 * (J - 1) * (J - 1);
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
  static constexpr float least_poisson = -1;
  static IsochoricNeoHookean of(const TledOptions&) { return {}; }
  static float added_stiffness_Pa(float) { return 0; }
  TACTUS_HD GradientColumns stress(const GradientColumns& F, float mu, float lambda) const {
    const GradientColumns cof = cofactor(F);
    const float J = fused_dot(F.x, cof.x), safe = max(J, kSmallestJ), r = inverse_cbrt(safe);
    const float shape = mu * r * r, trace = trace_C(F);
    const float bulk = fma(0.6666666667F, mu, lambda);
    return combine(shape, F, bulk * (J - 1.F) - shape * trace / (3.F * safe), cof);
  }
  double energy(const Mat3d& F, double mu, double lambda) const {
    const double J = determinant(F), safe = std::max(J, double{kSmallestJ});
    return mu / 2 * (trace_C(F) / std::pow(safe, 2.0 / 3) - 3) +
           (lambda + 2 * mu / 3) / 2 * (J - 1) * (J - 1);
  }
};

/// Neo-Hookean ground and fibres along a that resist stretch only: + c/2 max(a.Ca - 1, 0)^2, c = ratio mu.
struct TransverselyIsotropic {
  Vec3f fibre{1, 0, 0};  ///< a, unit, rest frame
  float ratio = 0;       ///< fibre stiffness over mu
  static constexpr float least_poisson = 0;
  static TransverselyIsotropic of(const TledOptions& o) {
    return {normalized(o.fibre, Vec3f{1, 0, 0}), o.fibre_ratio};
  }
  /// Fibres add at most 2 c (3 a.Ca - 1) to the stiffness along them: at 1.5 times the length, 11.5 c.
  float added_stiffness_Pa(float mu) const { return 11.5F * ratio * mu; }
  TACTUS_HD GradientColumns stress(const GradientColumns& F, float mu, float lambda) const {
    const GradientColumns ground = NeoHookean{}.stress(F, mu, lambda);
    const Vec3f Fa = fibre.x * F.x + fibre.y * F.y + fibre.z * F.z;
    const float pull = 2.F * ratio * mu * max(dot(Fa, Fa) - 1.F, 0.F);
    return {ground.x + (pull * fibre.x) * Fa, ground.y + (pull * fibre.y) * Fa,
            ground.z + (pull * fibre.z) * Fa};
  }
  double energy(const Mat3d& F, double mu, double lambda) const {
    const Vec3d Fa = F * vec_cast<double>(fibre);
    const double stretch = std::max(dot(Fa, Fa) - 1, 0.0);
    return NeoHookean{}.energy(F, mu, lambda) + double{ratio} * mu / 2 * stretch * stretch;
  }
};

/// Calls f with the law that the options name.
template <class F>
auto with_law(const TledOptions& options, F&& f) {
  switch (options.law) {
#define TACTUS_ROW(word, Law) \
  case MaterialLaw::word:     \
    return f(Law::of(options));
    TACTUS_MATERIAL_LAWS(TACTUS_ROW)
#undef TACTUS_ROW
  }
  return f(NeoHookean{});
}

}  // namespace tactus
