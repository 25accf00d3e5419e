#pragma once
/// Forces of a deformed cube on its corners [P 3-6].
///
/// Eight values at the corners of a cube are eight sums with signs (Walsh-Hadamard modes): a constant, three
/// gradients, and four hourglass modes, orthogonal because all cubes are cubes. Forces come back the same
/// way. Every `force` is always inlined: a loop over lanes with a call in it doesn't vectorise, and g++ calls
/// functions that are large or used by several kernels.
#include "tactus/frame/frame_params.h"
#include "tactus/tissue/tled/material_laws.h"
#include "tactus/tissue/tled/tled_data.h"

namespace tactus::tled {

/// Values of one cube as sums over its corners with the signs of x, y, z and their products.
struct CubeModes {
  Vec3f x, y, z, xy, yz, xz, xyz;
};

/// Resistance to the hourglass modes of a cube with one integration point: energy as if strain varied
/// linearly in the cube without parasitic shear (Belytschko & Bindeman 1993), with three amendments [ours].
/// - Modes that bend have E, not E/(1 - nu^2) and coupling: k = h E / 6 each.
/// - The twists (x of yz, y of xz, z of xy: A, B, C) have the shear strains A + B, B + C and C + A, and 0.844
///   times mu: the torsion constant of a square, 0.1406 h^4, over its polar moment h^4 / 6 (Saint-Venant
///   1855). t = 0.844 h mu / 6.
/// - Axes turn with the cube: A = F.x . yz. A column of F is not of length 1, so bodies stretched by half
///   would lose the resistance to their hourglass modes: the difference of t and k fades with tr C.
///   W = (k sum |u|^2 - fade ((k - t) (A^2 + B^2 + C^2) - t (A + B + C)^2)) / 16
struct HourglassControl {
  static constexpr float kTwist = 0.8436F;
  /// 1 up to tr C = 3.06 (sheared by 0.25), 0 from 6.29.
  TACTUS_HD static float fade(float trace_C) { return min(max(1.95F - 0.31F * trace_C, 0.F), 1.F); }
};

/// Forces of a cube with one integration point at its centre, and hourglass control. `fade` is taken as
/// constant in the derivative: it is so where strains are small.
template <class Law>
struct OnePointCube {
  /// Three blocks hide the memory's latency, and need 80 registers a thread at most. With 94 and two, a
  /// substep of a million cubes took 66 us instead of 47 on an H200.
  static constexpr int kLeastBlocks = 3;
  Law law;
  float gradient_per_m;  ///< 1 / (4 h)
  float area_m2;         ///< h^2 / 4
  float twist_m;         ///< t / (8 mu), of the part of mu that lasts
  float hourglass;       ///< 1 / 8
  TACTUS_HD TACTUS_ALWAYS_INLINE CubeModes force(const CubeModes& u, const Stiffness& of,
                                                 Index /*cell*/) const {
    const float s = gradient_per_m, a = -area_m2;
    const GradientColumns F{s * u.x, s * u.y, s * u.z}, P = law.stress(F, a * of.mu_Pa, a * of.lambda_Pa);
    const float k = -hourglass * of.hourglass_N_m, t = -twist_m * of.mu_Pa;
    const float A = fused_dot(F.x, u.yz), B = fused_dot(F.y, u.xz), C = fused_dot(F.z, u.xy);
    const float fade = HourglassControl::fade(trace_C(F));
    const float less = fade * (t - k), all = fade * t * (A + B + C);
    const float f_A = fma(less, A, all), f_B = fma(less, B, all), f_C = fma(less, C, all);
    return {fused_add(P.x, s * f_A, u.yz),
            fused_add(P.y, s * f_B, u.xz),
            fused_add(P.z, s * f_C, u.xy),
            fused_add(k * u.xy, f_C, F.z),
            fused_add(k * u.yz, f_A, F.x),
            fused_add(k * u.xz, f_B, F.y),
            k * u.xyz};
  }
};

/// The same with 2x2x2 points: no hourglass modes, but it locks in bending. Kept as a check.
template <class Law>
struct EightPointCube {
  static constexpr int kLeastBlocks = 0;
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
TACTUS_HD inline float faded_share(float x) {
  int doublings = 0;
  for (x = min(x, 64.F); x > 0.125F; x *= 0.5F) ++doublings;
  float sum = 0;  // x - x^2/2! + x^3/3! ...: the rest is below 1e-9 of it
  for (int n = 6; n > 0; --n) sum = x / static_cast<float>(n) * (1.F - sum);
  for (; doublings > 0; --doublings) sum = sum * (2.F - sum);
  return sum;
}

/// A cube whose shear stress fades (Taylor et al. 2009). S = S_law - sum g_n with g_n' = (share_n S_shear -
/// g_n) / time_n, S_shear being the second Piola-Kirchhoff stress that mu gives: it does not turn with the
/// body. A step takes g_n + fade_n (share_n S_shear - g_n), fade_n = 1 - exp(-dt / time_n): exact for a held
/// strain and any step. A term that is added gives share_n S_shear more. Cubes at a tile's border are seen by
/// several tiles, which all write the same.
template <class Law, int Terms>
struct RelaxingCube {
  static constexpr int kLeastBlocks = 0, kTerms = Terms;
  OnePointCube<Law> elastic;
  View<const float> before;  ///< g_n: xx, yy, zz, yz, zx, xy per term [Pa]; fields over cells
  View<float> after;         ///< out
  Index cells;
  StepTime time;
  float share[kTerms], rate_per_s[kTerms];  ///< 1 / time_n
  float added_share;                        ///< of all terms that are added
  float fade[kTerms] = {};
  TACTUS_HD void load() {
    time.load();
    for (Index n = 0; n < kTerms; ++n)
      fade[n] = time.settles() ? 1.F : faded_share(time.dt_s * rate_per_s[n]);
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
    float g[6];
    for (Index i = 0; i < 6; ++i) g[i] = -added_share * S[i];
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
