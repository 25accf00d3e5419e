#pragma once
/// Weakly compressible SPH (Becker & Teschner 2007): density and pressure, then forces and the step.
#include "tactus/fluid/shear_kernels.h"
#include "tactus/fluid/tension_kernels.h"
#include "tactus/fluid/wall_kernels.h"
#include "tactus/geom/search/neighbour_visit.h"

namespace tactus {

/// rho_i = sum_j m W_ij + rho0 fill_i, with the fill of walls; p = rho0 c^2 / 7 ((rho / rho0)^7 - 1), and no
/// tension: p >= 0.
/// @tparam kHasSurface finds where the surface is, too
template <bool kHasSurface>
struct LiquidDensity {
  static constexpr float kDensest = 1.5F;  ///< liquid that is squeezed more has no more pressure
  template <int kLanes>
  struct Own {
    static constexpr int kSlopes = kHasSurface ? kLanes : 1;
    float sum[kLanes], x[kSlopes], y[kSlopes], z[kSlopes];
  };
  LiquidConstants liquid;
  NearWalls walls;
  View<const Index> order;
  View<const Vec3f> v_m_s;  ///< as particles were given to the search
  View<float> density_kg_m3;
  View<LiquidMotion> motion;
  View<LiquidNormal> surface = {};  ///< kHasSurface

  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index) const {
    own.sum[t] = 0;
    if constexpr (kHasSurface) own.x[t] = own.y[t] = own.z[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index, Vec3f d, float r2_m2, bool near) const {
    const float w = SmoothingKernel::shape(tactus::sqrt(r2_m2) * liquid.kernel.inverse_d_1_m);
    own.sum[t] += near ? w : 0.F;
    if constexpr (kHasSurface) {
      const float inverse_r = liquid.inverse_distance_1_m(r2_m2),
                  q = r2_m2 * inverse_r * liquid.kernel.inverse_d_1_m,
                  slope = near ? SmoothingKernel::slope(q, inverse_r * liquid.spacing_m) : 0.F;
      own.x[t] = fma(slope, d.x, own.x[t]);
      own.y[t] = fma(slope, d.y, own.y[t]);
      own.z[t] = fma(slope, d.z, own.z[t]);
    }
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    float rho = liquid.mass_kg * liquid.kernel.scale_1_m3() * own.sum[t];
    if (walls.count[i] > 0) rho += liquid.density_kg_m3 * WallFill::of(walls, i, liquid);
    const float ratio = min(rho / liquid.density_kg_m3, kDensest), r2 = ratio * ratio, r6 = r2 * r2 * r2;
    const float p = max(0.F, liquid.tait_Pa * (r6 * ratio - 1));
    density_kg_m3[i] = rho;
    motion[i] = {v_m_s[order[i]], p / (rho * rho)};
    if constexpr (kHasSurface)
      surface[i] = surface_of(liquid, walls, i, {own.x[t], own.y[t], own.z[t]}, own.sum[t]);
  }
};

/// The acceleration of particle i:
///
///   - sum_j m (p_i / rho_i^2 + p_j / rho_j^2) grad W              pressure (Monaghan 1992)
///   + sum_j m alpha c d / rho0 min(v_ij . x_ij, 0) / r^2 grad W   artificial viscosity (Monaghan & Gingold
///   1983)
///   + sum_j m 10 nu / rho0 G (v_j - v_i) . x_ij / r^2 x_ij        viscosity (ViscousKernel)
///
/// and of a wall at distance s with normal n, whose fill has the slope -f, and on which the liquid does not
/// slip:
///
///   + rho0 p_wall / rho_i^2 f n - nu friction(s / d) / (s d) (v_i - v_wall)_t
///
/// and another acceleration a (PulledBySurface). p_wall = p_i - rho g . n s (push_at_wall). v_wall is that of
/// the wall if it reached to the particle: liquid that turns with its wall isn't sheared.
///
/// Velocities are stepped first, then positions with the new ones: LiquidStepped.
///
/// @tparam kThins nu is (nu_i + nu_j) / 2
template <bool kThins>
struct LiquidForce {
  static constexpr int kAtOnce = 4;
  template <int kLanes>
  struct Own {
    float vx[kLanes], vy[kLanes], vz[kLanes], push[kLanes];
    float ax[kLanes], ay[kLanes], az[kLanes], nu[kThins ? kLanes : 1];
  };
  LiquidConstants liquid;
  StepTime time;
  NearWalls walls;
  View<const SearchParticle> particles;
  View<const LiquidMotion> motion;
  LiquidStepped stepped;
  View<const float> shear_m2_s = {};  ///< kThins

  TACTUS_HD void load() {
    time.load();
    if (time.settles()) time.dt_s = 0;
  }
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    const LiquidMotion m = motion[i];
    own.vx[t] = m.v_m_s.x, own.vy[t] = m.v_m_s.y, own.vz[t] = m.v_m_s.z;
    own.push[t] = m.push;
    own.ax[t] = own.ay[t] = own.az[t] = 0;
    if constexpr (kThins) own.nu[t] = shear_m2_s[i];
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near) const {
    const LiquidMotion m = load_constant(motion, j);
    const PairViscosity pair = PairViscosity::of(liquid, r2_m2);
    const float x = m.v_m_s.x - own.vx[t], y = m.v_m_s.y - own.vy[t], z = m.v_m_s.z - own.vz[t];
    const float apart = fma(x, d.x, fma(y, d.y, z * d.z)) * (pair.inverse_r * pair.inverse_r);
    float nu = liquid.shear_m2_s;
    if constexpr (kThins) nu = 0.5F * (own.nu[t] + shear_m2_s[j]);
    const float all = fma(
        pair.slope, fma(liquid.damping_m2_s, min(0.F, apart), -liquid.density_kg_m3 * (own.push[t] + m.push)),
        nu * pair.weight * apart);
    const float along = near ? all : 0.F;
    own.ax[t] = fma(along, d.x, own.ax[t]);
    own.ay[t] = fma(along, d.y, own.ay[t]);
    own.az[t] = fma(along, d.z, own.az[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i, Vec3f a_m_s2 = {}) const {
    const Vec3f before{own.vx[t], own.vy[t], own.vz[t]};
    const float scale = liquid.mass_kg / liquid.density_kg_m3 * liquid.kernel.slope_scale_1_m5();
    const Vec3f v =
        before + time.dt_s * (scale * Vec3f{own.ax[t], own.ay[t], own.az[t]} + time.gravity_m_s2 + a_m_s2);
    stepped.end(liquid, walls, particles[i], i, time.dt_s * own.push[t], before, time, v);
  }
};

}  // namespace tactus
