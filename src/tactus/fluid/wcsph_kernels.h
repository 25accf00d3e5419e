#pragma once
/// Weakly compressible SPH (Becker & Teschner 2007): density and pressure, then forces and the step.
#include "tactus/fluid/wall_kernels.h"
#include "tactus/geom/neighbour_visit.h"

namespace tactus {

/// rho_i = sum_j m W_ij + rho0 fill_i, with what walls fill; p = rho0 c^2 / 7 ((rho / rho0)^7 - 1), and no
/// tension: p >= 0.
struct LiquidDensity {
  static constexpr float kDensest = 1.5F;  ///< what is squeezed more has no more pressure
  template <int kLanes>
  struct Own {
    float sum[kLanes];
  };
  LiquidConstants liquid;
  NearWalls walls;
  View<const Index> order;
  View<const Vec3f> v_m_s;  ///< as particles were given to the search
  View<float> density_kg_m3;
  View<LiquidMotion> motion;

  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index) const {
    own.sum[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index, Vec3f, float r2_m2, bool near) const {
    const float w = SmoothingKernel::shape(tactus::sqrt(r2_m2) * liquid.kernel.inverse_d_1_m);
    own.sum[t] += near ? w : 0.F;
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    float rho = liquid.mass_kg * liquid.kernel.scale_1_m3() * own.sum[t];
    if (walls.count[i] > 0) rho += liquid.density_kg_m3 * WallShare::of(walls, i, liquid).fill;
    const float ratio = min(rho / liquid.density_kg_m3, kDensest), r2 = ratio * ratio, r6 = r2 * r2 * r2;
    const float p = max(0.F, liquid.tait_Pa * (r6 * ratio - 1));
    density_kg_m3[i] = rho;
    motion[i] = {v_m_s[order[i]], p / (rho * rho)};
  }
};

/// The acceleration of particle i:
///
///   - sum_j m (p_i / rho_i^2 + p_j / rho_j^2) grad W              pressure (Monaghan 1992)
///   + sum_j m alpha c d / rho0 min(v_ij . x_ij, 0) / r^2 grad W   artificial viscosity (Monaghan & Gingold
///   1983)
///   + sum_j m 2 nu / rho0 (-W' / r) (v_j - v_i)                   viscosity (Morris et al. 1997)
///
/// and of a wall at distance s with normal n, whose fill has the slope -f, and on which the liquid does not
/// slip: behind it the velocity goes on linearly, and the integral of the viscosity is one of the area A(s):
///
///   + rho0 p_i / rho_i^2 f n - 2 nu A / s (v_i - v_wall)_t
///
/// Velocities are stepped first, then positions with the new ones. No particle gets nearer to a wall than
/// closest_m: it is put back there, by a tenth of a spacing a step, and loses the velocity towards the wall.
struct LiquidForce {
  static constexpr float kFarthestBack = 0.1F;  ///< in spacings: what appears in a pool must not blow it up
  template <int kLanes>
  struct Own {
    float vx[kLanes], vy[kLanes], vz[kLanes], push[kLanes];
    float ax[kLanes], ay[kLanes], az[kLanes];
  };
  LiquidConstants liquid;
  StepTime time;
  NearWalls walls;
  View<const SearchParticle> particles;
  View<const LiquidMotion> motion;
  View<Vec3f> x_m, v_m_s;  ///< after the step, by slot
  View<Index> id;
  LiquidEnds ends;
  View<WallSums> wall_sums;

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
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near) const {
    const LiquidMotion m = load_constant(motion, j);
    const float inverse_r = 1.F / tactus::sqrt(max(r2_m2, 1e-12F * sqr(liquid.spacing_m)));
    const float q = r2_m2 * inverse_r * liquid.kernel.inverse_d_1_m;
    const float slope = SmoothingKernel::slope(q, inverse_r * liquid.spacing_m);
    const float x = m.v_m_s.x - own.vx[t], y = m.v_m_s.y - own.vy[t], z = m.v_m_s.z - own.vz[t];
    const float approach = min(0.F, fma(x, d.x, fma(y, d.y, z * d.z))) * (inverse_r * inverse_r);
    const float weight = near ? slope : 0.F;
    const float along =
        weight * (liquid.damping_m2_s * approach - liquid.density_kg_m3 * (own.push[t] + m.push));
    const float drag = weight * (2 * liquid.shear_m2_s);
    own.ax[t] += fma(along, d.x, drag * x);
    own.ay[t] += fma(along, d.y, drag * y);
    own.az[t] += fma(along, d.z, drag * z);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const Vec3f before{own.vx[t], own.vy[t], own.vz[t]}, x = particles[i].x_m;
    const float scale = liquid.mass_kg / liquid.density_kg_m3 * liquid.kernel.slope_scale_1_m5();
    Vec3f v = before + time.dt_s * (scale * Vec3f{own.ax[t], own.ay[t], own.az[t]} + time.gravity_m_s2);
    Vec3f put_back{};
    if (walls.count[i] > 0) meet_walls(i, own.push[t], before, v, put_back);
    x_m[i] = ends.kept(x + (time.dt_s * v + put_back));
    v_m_s[i] = v;
    id[i] = particles[i].id;
  }

 private:
  TACTUS_HD void meet_walls(Index i, float push, Vec3f before, Vec3f& v, Vec3f& put_back) const {
    const WallShare share = WallShare::of(walls, i, liquid);
    for (Index k = 0, n = walls.count[i]; k < n; ++k) {
      NearWall& wall = walls.at(i, k);
      const Vec3f rel = before - wall.velocity_m_s, slide = rel - dot(rel, wall.n) * wall.n;
      const float s = max(wall.distance_m, liquid.closest_m);
      // Friction must not turn the velocity round. What gives way takes its share of a blow.
      const float yields = liquid.mass_kg * wall.give_1_kg,
                  drag = min(time.dt_s * 2 * liquid.shear_m2_s * liquid.kernel.area_1_m(s) / s, 1.F);
      const float push_m_s = time.dt_s * liquid.density_kg_m3 * push * share.slope_1_m[k];
      Vec3f kick = push_m_s * wall.n - drag / (1.F + drag * yields) * slide;
      v += kick;
      const float approach = dot(v - wall.velocity_m_s, wall.n) + yields * dot(kick, wall.n);
      const float gap = wall.distance_m + time.dt_s * approach - liquid.closest_m;
      if (gap < 0.F) {
        const Vec3f stop = max(-approach, 0.F) / (1.F + yields) * wall.n;
        v += stop;
        kick += stop;
        const float left = liquid.closest_m - (wall.distance_m + time.dt_s * max(approach, 0.F));
        put_back += clamp(left, 0.F, kFarthestBack * liquid.spacing_m) / (1.F + yields) * wall.n;
      }
      wall.impulse_N_s = -liquid.mass_kg * kick;
      wall_sums[wall.owner * WallSums::kCopies + i % WallSums::kCopies].add_atomically(wall.impulse_N_s);
    }
  }
};

}  // namespace tactus
