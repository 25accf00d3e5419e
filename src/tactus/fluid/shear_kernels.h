#pragma once
/// Viscosity between pairs of particles, and shear rates.
#include "tactus/fluid/liquid_views.h"
#include "tactus/geom/search/neighbour_visit.h"

namespace tactus {

/// Factors of the forces between two particles, over slope_scale().
struct PairViscosity {
  float inverse_r;
  float slope;   ///< -W' / r
  float weight;  ///< 10 G
  TACTUS_HD static PairViscosity of(const LiquidConstants& liquid, float r2_m2) {
    const float inverse_r = liquid.inverse_distance_1_m(r2_m2);
    const float q = r2_m2 * inverse_r * liquid.kernel.inverse_d_1_m, t = max(0.F, 2 - q);
    return {inverse_r, SmoothingKernel::slope(q, inverse_r * liquid.spacing_m),
            (10 * ViscousKernel::kWeight) * q * (t * t)};
  }
};

/// Shear rates, and the viscosity that they leave. Viscous forces dissipate nu rate^2; the shares of particle
/// i's neighbours in that are the square of its shear rate, which rotation leaves alone:
///
///   rate_i^2 = (sum_j V 5 G ((v_j - v_i) . x_ij)^2 / r^2 + behind (u / s)^2) / (sum_j V G r^2 / 3 + behind)
///
/// with the share behind(s / d) of walls, where the liquid is sheared by u / s. The divisor is the same sum
/// for shear at rate 1: it makes up for missing neighbours at surfaces.
struct LiquidShear {
  template <int kLanes>
  struct Own {
    float vx[kLanes], vy[kLanes], vz[kLanes], rate2[kLanes], weight[kLanes];
  };
  LiquidConstants liquid;
  NearWalls walls;
  View<const LiquidMotion> motion;
  View<float> shear_m2_s;

  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    const Vec3f v = motion[i].v_m_s;
    own.vx[t] = v.x, own.vy[t] = v.y, own.vz[t] = v.z;
    own.rate2[t] = own.weight[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near) const {
    const Vec3f v = load_constant(motion, j).v_m_s;
    const PairViscosity pair = PairViscosity::of(liquid, r2_m2);
    const float x = v.x - own.vx[t], y = v.y - own.vy[t], z = v.z - own.vz[t];
    const float apart = fma(x, d.x, fma(y, d.y, z * d.z)) * pair.inverse_r;
    const float weight = near ? pair.weight : 0.F;
    own.rate2[t] = fma(weight, apart * apart, own.rate2[t]);
    own.weight[t] = fma(weight, r2_m2, own.weight[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const float scale = liquid.mass_kg / liquid.density_kg_m3 * liquid.kernel.slope_scale_1_m5();
    float rate2 = 0.5F * scale * own.rate2[t], weight = 1.F / 30 * scale * own.weight[t];
    const Vec3f v{own.vx[t], own.vy[t], own.vz[t]};
    TACTUS_ROLLED
    for (Index k = 0, n = walls.count[i]; k < n; ++k) {
      const NearWall wall = walls.read(i, k);
      if (wall.is_beside()) continue;
      const Vec3f rel = v - wall.velocity_m_s, slide = rel - dot(rel, wall.n) * wall.n;
      const float s = max(wall.distance_m, liquid.closest_m),
                  behind = ViscousKernel::behind(s * liquid.kernel.inverse_d_1_m);
      rate2 += behind * dot(slide, slide) / sqr(s);
      weight += behind;
    }
    shear_m2_s[i] = liquid.thinning.at(rate2 / max(weight, 0.1F));
  }
};

}  // namespace tactus
