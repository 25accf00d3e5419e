#pragma once
/// Surface tension as a force at the surface (Brackbill, Kothe & Zemach 1992), for a liquid that has nothing
/// beside it. With V = m / rho0 and the kernel's sums, each in a visit, the first and the last with others':
///
///   g_i = sum_j V grad W - A(s) n of walls                     towards the liquid; a wall counts as liquid
///   m_i = sum_j W_ij g_j / sum_k W_jk                          smoothed, with the same sum as g; n = m / |m|
///   k_i = 2 sum_j w (n_i - n_j) . x_ij / sum_j w |x_ij - n_i n_i . x_ij|^2,   w = W |m_j|
///   a_i = 2 sigma / rho0 k m_i                                 with the mean of k over w, corrected as below
///
/// 2, because the integral of grad W over the side of the liquid is 1/2. Normals of a ball differ by
/// x_ij / r: so k is 2 / r for every pair, and the sum of both curvatures elsewhere. Without the smoothing of
/// normals, drops boil.
///
/// k is measured below the surface. On a lattice, layers at d/2 and 3 d/2 have the shares 0.824 and 0.176 of
/// m, so the mean depth is 0.676 d. And from a ball of radius R more is missing than from a half-space:
/// grad W integrates to 1/2 (1 + 0.443 d / R), 2 pi int W r^3 dr = 31/70 d. So k is divided by
/// 1 + (0.676 + 0.443) d k / 2.
#include "tactus/fluid/liquid_views.h"
#include "tactus/geom/search/neighbour_visit.h"

namespace tactus {

/// g of particle i. @param slopes sum_j -W' / r d, over slope_scale_1_m5() @param shapes sum_j W, over
/// scale_1_m3()
TACTUS_HD inline LiquidNormal surface_of(const LiquidConstants& liquid, const NearWalls& walls, Index i,
                                         Vec3f slopes, float shapes) {
  const float volume_m3 = liquid.mass_kg / liquid.density_kg_m3;
  Vec3f g = volume_m3 * liquid.kernel.slope_scale_1_m5() * slopes;
  TACTUS_ROLLED
  for (Index k = 0, n = walls.count[i]; k < n; ++k) {
    const NearWall& wall = walls.at(i, k);
    g -= wall.share * liquid.kernel.area_1_m(wall.distance_m) * wall.n;
  }
  const float sum = volume_m3 * liquid.kernel.scale_1_m3() * shapes;
  return {liquid.spacing_m / max(sum, 0.1F) * g, 0.F};
}

/// n and |m|. In the layer beside a wall, the surface meets the wall at the contact angle, which is measured
/// in the liquid: n = -cos n_wall + sin t, with the direction t of m along the wall.
struct SmoothNormals {
  static constexpr float kLeast = 0.05F;  ///< of |m| d; 0.42 at a lattice's surface
  static constexpr float kAside = 0.2F;   ///< where less of m is along the wall, there is no line of contact
  template <int kLanes>
  struct Own {
    float x[kLanes], y[kLanes], z[kLanes];
  };
  LiquidConstants liquid;
  NearWalls walls;
  View<const LiquidNormal> surface;
  View<LiquidNormal> smooth;

  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index) const {
    own.x[t] = own.y[t] = own.z[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f, float r2_m2, bool near) const {
    const Vec3f g = load_constant(surface, j).n;
    const float shape = SmoothingKernel::shape(tactus::sqrt(r2_m2) * liquid.kernel.inverse_d_1_m);
    const float w = near ? shape : 0.F;
    own.x[t] = fma(w, g.x, own.x[t]);
    own.y[t] = fma(w, g.y, own.y[t]);
    own.z[t] = fma(w, g.z, own.z[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const float scale = liquid.mass_kg / liquid.density_kg_m3 * liquid.kernel.scale_1_m3();
    const Vec3f m = scale * Vec3f{own.x[t], own.y[t], own.z[t]};
    const float size = length(m);
    if (!(size > kLeast)) {
      smooth[i] = {};
      return;
    }
    Vec3f n = (1.F / size) * m;
    for (Index k = 0, count = walls.count[i]; k < count; ++k) {
      const NearWall& wall = walls.at(i, k);
      const Vec3f aside = n - dot(n, wall.n) * wall.n;
      const float along = length(aside);
      if (!wall.is_beside() && wall.distance_m < liquid.spacing_m && along > kAside)
        n = (liquid.contact_sin / along) * aside - liquid.contact_cos * wall.n;
    }
    smooth[i] = {n, size};
  }
};

/// The curvature of the liquid's surface, in 1 / spacings.
struct FindCurvature {
  static constexpr float kLeastSpread =
      0.02F;  ///< of the sum of w |x|^2: nothing is known of a single particle
  template <int kLanes>
  struct Own {
    float x[kLanes], y[kLanes], z[kLanes], turns[kLanes], spread[kLanes];
  };
  LiquidConstants liquid;
  View<const LiquidNormal> smooth;
  View<float> curvature;

  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    const Vec3f n = smooth[i].n;
    own.x[t] = n.x, own.y[t] = n.y, own.z[t] = n.z;
    own.turns[t] = own.spread[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near) const {
    const LiquidNormal other = load_constant(smooth, j);
    const float shape = SmoothingKernel::shape(tactus::sqrt(r2_m2) * liquid.kernel.inverse_d_1_m);
    const float w = near ? shape * other.size : 0.F;
    const float x = own.x[t] - other.n.x, y = own.y[t] - other.n.y, z = own.z[t] - other.n.z;
    const float up = fma(own.x[t], d.x, fma(own.y[t], d.y, own.z[t] * d.z));
    own.turns[t] = fma(w, fma(x, d.x, fma(y, d.y, z * d.z)), own.turns[t]);
    own.spread[t] = fma(w, fma(-up, up, r2_m2), own.spread[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    constexpr float kShape = 1 / (4 * kPi);
    const float d = liquid.spacing_m, spread = kShape * own.spread[t] / sqr(d),
                turns = kShape * own.turns[t] / d;
    const bool known = smooth[i].size > 0.F && spread > kLeastSpread;
    curvature[i] = known ? clamp(2 * turns / spread, -1.F, 1.F) : 0.F;
  }
};

/// A liquid's forces (DfsphForce, LiquidForce), and a beside them.
template <class Force>
struct PulledBySurface {
  static constexpr int kAtOnce = 4;
  static constexpr float kDepth = 0.676F + 0.443F;
  template <int kLanes>
  struct Own {
    typename Force::template Own<kLanes> force;
    float turns[kLanes], weight[kLanes];
  };
  Force force;
  View<const LiquidNormal> smooth;
  View<const float> curvature;

  TACTUS_HD void load() { force.load(); }
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    force.begin(own.force, t, i);
    own.turns[t] = own.weight[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near) const {
    force.add(own.force, t, j, d, r2_m2, near);
    // Loaded whether near or not: a load under a condition keeps a CPU's loop over lanes from SIMD.
    const float size = load_constant(smooth, j).size, of_other = curvature[j];
    const LiquidConstants& liquid = force.liquid;
    const float q = r2_m2 * liquid.inverse_distance_1_m(r2_m2) * liquid.kernel.inverse_d_1_m,
                shape = SmoothingKernel::shape(q), w = near ? shape * size : 0.F;
    own.turns[t] = fma(w, of_other, own.turns[t]);
    own.weight[t] += w;
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const LiquidConstants& liquid = force.liquid;
    const LiquidNormal at = smooth[i];
    Vec3f a_m_s2{};
    if (at.size > 0.F) {
      const float mean = own.turns[t] / own.weight[t], k = mean / (1.F + 0.5F * kDepth * mean);
      a_m_s2 = (2 * liquid.tension_N_m / liquid.density_kg_m3 * k * at.size / sqr(liquid.spacing_m)) * at.n;
    }
    force.end(own.force, t, i, a_m_s2);
  }
};

}  // namespace tactus
