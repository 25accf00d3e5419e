#pragma once
/// What a cube's deformation exerts on its corners [P 3-6].
///
/// Eight values at the corners of a cube are eight sums with signs (Walsh-Hadamard modes): a constant, three
/// gradients, and four hourglass modes, orthogonal because all cubes are cubes. Forces come back the same
/// way. Every `force` is always inlined: a loop over lanes with a call in it doesn't vectorise, and g++ calls
/// what is large or used by several kernels.
#include "tactus/frame/frame_params.h"
#include "tactus/tissue/tled/material_laws.h"

namespace tactus::tled {

/// Values of one cube as sums over its corners with the signs of x, y, z and their products.
struct CubeModes {
  Vec3f x, y, z, xy, yz, xz, xyz;
};

/// What cubes of one kind are made of.
struct alignas(16) Stiffness {
  float mu_Pa = 0, lambda_Pa = 0;
  float hourglass_N_m = 0;
};

/// Forces of a cube with one integration point at its centre; the four hourglass modes, without stress there,
/// get stiffness k (Joldes et al. 2008): f = (k/8) sum h h^T u.
template <class Law>
struct OnePointCube {
  Law law;
  float gradient_per_m;  ///< 1 / (4 h)
  float area_m2;         ///< h^2 / 4
  TACTUS_HD TACTUS_ALWAYS_INLINE CubeModes force(const CubeModes& u, const Stiffness& of,
                                                 Index /*cell*/) const {
    const float s = gradient_per_m;
    const GradientColumns P = law.stress({s * u.x, s * u.y, s * u.z}, of.mu_Pa, of.lambda_Pa);
    const float k = -0.125F * of.hourglass_N_m, a = -area_m2;
    return {a * P.x, a * P.y, a * P.z, k * u.xy, k * u.yz, k * u.xz, k * u.xyz};
  }
};

/// The same with 2x2x2 points: no hourglass modes, but it locks in bending. Kept as a check.
template <class Law>
struct EightPointCube {
  Law law;
  float gradient_per_m, area_m2;
  TACTUS_HD TACTUS_ALWAYS_INLINE CubeModes force(const CubeModes& u, const Stiffness& of,
                                                 Index /*cell*/) const {
    CubeModes f{};
    const float g = 0.577350269F, w = -0.125F * area_m2, s = gradient_per_m;
    for (int i = 0; i < 8; ++i) {
      const float a = (i & 1) != 0 ? g : -g, b = (i & 2) != 0 ? g : -g, c = (i & 4) != 0 ? g : -g;
      const GradientColumns P = law.stress({s * (u.x + b * u.xy + c * u.xz + (b * c) * u.xyz),
                                            s * (u.y + a * u.xy + c * u.yz + (a * c) * u.xyz),
                                            s * (u.z + a * u.xz + b * u.yz + (a * b) * u.xyz)},
                                           of.mu_Pa, of.lambda_Pa);
      f.x += w * P.x;
      f.y += w * P.y;
      f.z += w * P.z;
      f.xy += w * (b * P.x + a * P.y);
      f.xz += w * (c * P.x + a * P.z);
      f.yz += w * (c * P.y + b * P.z);
      f.xyz += w * ((b * c) * P.x + (a * c) * P.y + (a * b) * P.z);
    }
    return f;
  }
};

/// 1 - exp(-x), x >= 0: a series where x is small, doubled up by 1 - exp(-2 x) = t (2 - t).
TACTUS_HD inline float faded_share(double x) {
  int doublings = 0;
  for (x = min(x, 64.0); x > 0.125; x *= 0.5) ++doublings;
  double sum = 0;
  for (int n = 9; n > 0; --n) sum = x / n * (1 - sum);  // x - x^2/2! + x^3/3! ...: the rest is below 1e-15
  for (; doublings > 0; --doublings) sum = sum * (2 - sum);
  return static_cast<float>(sum);
}

/// A cube whose shear stress fades (Taylor et al. 2009). S = S_law - sum g_n with g_n' = (share_n S_shear -
/// g_n) / time_n, S_shear being the second Piola-Kirchhoff stress that mu gives: it does not turn with the
/// body. A step takes g_n + fade_n (share_n S_shear - g_n), fade_n = 1 - exp(-dt / time_n): exact for a held
/// strain, whatever the step. Cubes at a tile's border are seen by several tiles, which all write the same.
template <class Law>
struct RelaxingCube {
  static constexpr int kTerms = 2, kFields = 6 * kTerms;
  OnePointCube<Law> elastic;
  View<const float> before;  ///< g_n: xx, yy, zz, yz, zx, xy per term [Pa]; kFields fields over cells
  View<float> after;         ///< out
  Index cells;
  StepTime time;
  float share[kTerms], relaxation_s[kTerms];
  float fade[kTerms] = {};
  TACTUS_HD void load() {
    time.load();
    for (Index n = 0; n < kTerms; ++n)
      fade[n] = faded_share(static_cast<double>(time.dt_s) / static_cast<double>(relaxation_s[n]));
  }

  TACTUS_HD TACTUS_ALWAYS_INLINE CubeModes force(const CubeModes& u, const Stiffness& of, Index cell) const {
    CubeModes f = elastic.force(u, of, cell);
    const float s = elastic.gradient_per_m, a = elastic.area_m2;
    const GradientColumns F{s * u.x, s * u.y, s * u.z}, P = elastic.law.stress(F, of.mu_Pa, 0.F),
                                                        cof = cofactor(F);
    const float inverse_J = 1.F / max(dot(F.x, cof.x), kSmallestJ);  // F^-1 = cof^T / J
    const float S[6] = {inverse_J * dot(cof.x, P.x), inverse_J * dot(cof.y, P.y),
                        inverse_J * dot(cof.z, P.z), inverse_J * dot(cof.y, P.z),
                        inverse_J * dot(cof.z, P.x), inverse_J * dot(cof.x, P.y)};
    float g[6] = {};
    for (Index n = 0; n < kTerms; ++n) {
      for (Index i = 0; i < 6; ++i) {
        const Index at = (6 * n + i) * cells + cell;
        const float old = before[at], now = old + fade[n] * (share[n] * S[i] - old);
        after[at] = now;
        g[i] += now;
      }
    }
    f.x += a * (g[0] * F.x + g[5] * F.y + g[4] * F.z);
    f.y += a * (g[5] * F.x + g[1] * F.y + g[3] * F.z);
    f.z += a * (g[4] * F.x + g[3] * F.y + g[2] * F.z);
    return f;
  }
};

}  // namespace tactus::tled
