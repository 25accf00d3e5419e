#pragma once
/// Implicit incompressible SPH (Ihmsen, Cornelis, Solenthaler, Horvath, Teschner 2014): pressures such that
/// the density at the end of the step is at most that at rest, by a fixed number of Jacobi iterations that
/// begin with the pressures of the last step. With k_i = dt p_i / rho_i^2,
///
///   v_i     = v*_i - sum_j m (k_i + k_j) grad W + k_i rho0 f n       (f, n of walls)
///   Drho_i  = sum_j m (v_i - v_j) . grad W - rho0 f n . (v_i - v_wall)
///   k_i     = max(0, k_i + omega (rho_i + dt Drho_i - rho0) / (dt D_i)),    D_i = -d Drho_i / d k_i.
#include "tactus/fluid/wall_kernels.h"
#include "tactus/geom/neighbour_visit.h"

namespace tactus {

/// grad W = d slope, for all lanes of a visit alike.
struct PairSlope {
  TACTUS_HD static float of(const LiquidConstants& liquid, float r2_m2, bool near) {
    const float inverse_r = 1.F / tactus::sqrt(max(r2_m2, 1e-12F * sqr(liquid.spacing_m)));
    const float slope =
        SmoothingKernel::slope(r2_m2 * inverse_r * liquid.kernel.inverse_d_1_m, inverse_r * liquid.spacing_m);
    return near ? slope : 0.F;
  }
};

/// Density, D, and what walls add; begins with a share of the last step's k.
struct ImplicitDensity {
  static constexpr float kWarm = 0.5F;
  template <int kLanes>
  struct Own {
    float sum[kLanes], x[kLanes], y[kLanes], z[kLanes], square[kLanes];
  };
  LiquidConstants liquid;
  NearWalls walls;
  View<const Index> order;
  View<const Vec3f> v_m_s;      ///< as particles were given to the search
  View<const float> last_push;  ///< k, likewise
  View<float> density_kg_m3, inverse_D;
  View<LiquidMotion> motion;

  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index) const {
    own.sum[t] = own.x[t] = own.y[t] = own.z[t] = own.square[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index, Vec3f d, float r2_m2, bool near) const {
    const float w = SmoothingKernel::shape(tactus::sqrt(r2_m2) * liquid.kernel.inverse_d_1_m);
    const float slope = PairSlope::of(liquid, r2_m2, near);
    own.sum[t] += near ? w : 0.F;
    own.x[t] = fma(slope, d.x, own.x[t]);
    own.y[t] = fma(slope, d.y, own.y[t]);
    own.z[t] = fma(slope, d.z, own.z[t]);
    own.square[t] = fma(slope * slope, r2_m2, own.square[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const float m = liquid.mass_kg, scale = m * liquid.kernel.slope_scale_1_m5();
    float rho = m * liquid.kernel.scale_1_m3() * own.sum[t];
    Vec3f gradient = scale * Vec3f{own.x[t], own.y[t], own.z[t]};
    float D = sqr(scale) * own.square[t];
    if (const Index n = walls.count[i]; n > 0) {
      const WallShare share = WallShare::of(walls, i, liquid);
      rho += liquid.density_kg_m3 * share.fill;
      for (Index k = 0; k < n; ++k) {
        const float f = liquid.density_kg_m3 * share.slope_1_m[k];
        gradient -= f * walls.at(i, k).n;
        D += sqr(f) * m * walls.at(i, k).give_1_kg;
      }
    }
    D += dot(gradient, gradient);
    density_kg_m3[i] = rho;
    inverse_D[i] = D * sqr(liquid.spacing_m / liquid.density_kg_m3) > 1e-6F ? 1.F / D : 0.F;
    motion[i] = {v_m_s[order[i]], kWarm * last_push[order[i]]};
  }
};

/// v* = v + dt (viscosity, artificial viscosity, gravity).
struct ImplicitForce {
  template <int kLanes>
  struct Own {
    float vx[kLanes], vy[kLanes], vz[kLanes], ax[kLanes], ay[kLanes], az[kLanes];
  };
  LiquidConstants liquid;
  StepTime time;
  View<const LiquidMotion> motion;
  View<LiquidMotion> star;

  TACTUS_HD void load() { time.load(); }
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    const Vec3f v = motion[i].v_m_s;
    own.vx[t] = v.x, own.vy[t] = v.y, own.vz[t] = v.z;
    own.ax[t] = own.ay[t] = own.az[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f, float r2_m2, bool near) const {
    const LiquidMotion m = load_constant(motion, j);
    const float drag = PairSlope::of(liquid, r2_m2, near) * (2 * liquid.shear_m2_s);
    own.ax[t] = fma(drag, m.v_m_s.x - own.vx[t], own.ax[t]);
    own.ay[t] = fma(drag, m.v_m_s.y - own.vy[t], own.ay[t]);
    own.az[t] = fma(drag, m.v_m_s.z - own.vz[t], own.az[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const float scale = liquid.mass_kg / liquid.density_kg_m3 * liquid.kernel.slope_scale_1_m5();
    const Vec3f a = scale * Vec3f{own.ax[t], own.ay[t], own.az[t]} + time.gravity_m_s2;
    const float dt_s = time.settles() ? 0.F : time.dt_s;
    star[i] = {motion[i].v_m_s + dt_s * a, motion[i].push};
  }
};

/// v of k; the last time, with what walls do and the step itself.
template <bool kSteps>
struct ImplicitVelocity {
  template <int kLanes>
  struct Own {
    float push[kLanes], x[kLanes], y[kLanes], z[kLanes];
  };
  LiquidConstants liquid;
  StepTime time;
  NearWalls walls;
  View<const LiquidMotion> star;
  View<LiquidMotion> moved;  ///< not in the last
  // in the last:
  View<const SearchParticle> particles = {};
  View<const LiquidMotion> motion = {};  ///< before the step
  LiquidStepped stepped = {};
  View<float> last_push = {};

  TACTUS_HD void load() {
    time.load();
    if (time.settles()) time.dt_s = 0;
  }
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    own.push[t] = star[i].push;
    own.x[t] = own.y[t] = own.z[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near) const {
    const float along = PairSlope::of(liquid, r2_m2, near) * (own.push[t] + star[j].push);
    own.x[t] = fma(along, d.x, own.x[t]);
    own.y[t] = fma(along, d.y, own.y[t]);
    own.z[t] = fma(along, d.z, own.z[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const float scale = liquid.mass_kg * liquid.kernel.slope_scale_1_m5(), push = own.push[t];
    Vec3f v = star[i].v_m_s - scale * Vec3f{own.x[t], own.y[t], own.z[t]};
    if constexpr (kSteps) {
      last_push[i] = push;
      stepped.end(liquid, walls, particles[i], i, push, motion[i].v_m_s, time.dt_s, v);
    } else {
      if (const Index n = walls.count[i]; n > 0) {
        const WallShare share = WallShare::of(walls, i, liquid);
        for (Index k = 0; k < n; ++k)
          v += (push * liquid.density_kg_m3 * share.slope_1_m[k]) * walls.at(i, k).n;
      }
      moved[i] = {v, push};
    }
  }
};

/// One Jacobi step of all k.
struct ImplicitPressure {
  static constexpr float kRelaxation = 0.5F;
  template <int kLanes>
  struct Own {
    float vx[kLanes], vy[kLanes], vz[kLanes], sum[kLanes];
  };
  LiquidConstants liquid;
  StepTime time;
  NearWalls walls;
  View<const LiquidMotion> moved;
  View<const float> density_kg_m3, inverse_D;
  View<LiquidMotion> star;

  TACTUS_HD void load() { time.load(); }
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    const Vec3f v = moved[i].v_m_s;
    own.vx[t] = v.x, own.vy[t] = v.y, own.vz[t] = v.z;
    own.sum[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near) const {
    const LiquidMotion m = load_constant(moved, j);
    const float x = own.vx[t] - m.v_m_s.x, y = own.vy[t] - m.v_m_s.y, z = own.vz[t] - m.v_m_s.z;
    own.sum[t] = fma(PairSlope::of(liquid, r2_m2, near), fma(x, d.x, fma(y, d.y, z * d.z)), own.sum[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    if (!(time.dt_s > 0.F)) return;
    const Vec3f v{own.vx[t], own.vy[t], own.vz[t]};
    float rate = liquid.mass_kg * liquid.kernel.slope_scale_1_m5() * own.sum[t];
    const float push = star[i].push;
    if (const Index n = walls.count[i]; n > 0) {
      const WallShare share = WallShare::of(walls, i, liquid);
      for (Index k = 0; k < n; ++k) {
        const NearWall& wall = walls.at(i, k);
        const float f = liquid.density_kg_m3 * share.slope_1_m[k];
        rate -= f * (dot(wall.n, v - wall.velocity_m_s) + wall.give_1_kg * liquid.mass_kg * push * f);
      }
    }
    const float excess = density_kg_m3[i] + time.dt_s * rate - liquid.density_kg_m3;
    star[i].push = max(0.F, push + kRelaxation * excess * inverse_D[i] / time.dt_s);
  }
};

}  // namespace tactus
