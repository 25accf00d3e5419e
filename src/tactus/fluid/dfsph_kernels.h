#pragma once
/// Divergence-free SPH (Bender & Koschier 2015). Two solves make velocities that neither press the liquid nor
/// have it pressed at the end of the step. With k_i = dt p_i / rho_i^2, kappa_v of the first and k of the
/// second,
///
///   v_i     = v*_i - sum_j m (k_i + k_j) grad W + k_i rho0 f n       (f, n of walls)
///   Drho_i  = sum_j m (v_i - v_j) . grad W - rho0 f n . (v_i - v_wall)
///   kappa_v_i    = max(0, omega Drho_i / D_i),                             D_i = -d Drho_i / d k_i
///   k_i     = max(0, k_i + omega (rho_i + dt Drho_i - rho0) / (dt D_i)).
///
/// The second is a fixed number of Jacobi iterations. They begin with the k that the last step kept, and go
/// on by half of their last change (Nesterov 1983): two in place of three. With omega and the momentum beta
/// they converge for eigenvalues of the matrix over its diagonal D up to (2 + 2 beta) / (1 + 2 beta) / omega:
/// 3. Few particles that are squeezed have larger ones.
#include "tactus/fluid/shear_kernels.h"
#include "tactus/fluid/tension_kernels.h"
#include "tactus/fluid/wall_kernels.h"
#include "tactus/geom/search/neighbour_visit.h"

namespace tactus {

inline constexpr float kJacobiRelaxation = 0.5F;  ///< omega

/// grad W = d slope, for all lanes of a visit alike.
TACTUS_HD inline float pair_slope(const LiquidConstants& liquid, float r2_m2, bool near) {
  const float inverse_r = liquid.inverse_distance_1_m(r2_m2);
  const float slope =
      SmoothingKernel::slope(r2_m2 * inverse_r * liquid.kernel.inverse_d_1_m, inverse_r * liquid.spacing_m);
  return near ? slope : 0.F;
}

/// Drho/Dt that walls bring to a particle of velocity v that pushes them with k.
TACTUS_HD inline float wall_rate(const LiquidConstants& liquid, const NearWalls& walls, Index i, Vec3f v,
                                 float k) {
  const Index n = walls.count[i];
  if (n == 0) return 0;
  float rate = 0;
  TACTUS_ROLLED
  for (Index w = 0; w < n; ++w) {
    const NearWall wall = walls.read(i, w);
    const float f = liquid.density_kg_m3 * wall.slope_1_m;
    rate -= f * (dot(wall.n, v - wall.velocity_m_s) + wall.inverse_mass_1_kg * liquid.mass_kg * k * f);
  }
  return rate;
}
/// The velocity that walls give to a particle that pushes them with k.
TACTUS_HD inline Vec3f wall_correction(const LiquidConstants& liquid, const NearWalls& walls, Index i,
                                       float k, const StepTime& time) {
  const Index n = walls.count[i];
  Vec3f correction{};
  if (n == 0) return correction;
  TACTUS_ROLLED
  for (Index w = 0; w < n; ++w) {
    const NearWall wall = walls.read(i, w);
    const float push = push_at_wall(liquid, wall, k, time.dt_s * time.gravity_m_s2);
    correction += (push * liquid.density_kg_m3 * wall.slope_1_m) * wall.n;
  }
  return correction;
}

/// v and the first k, in the order of the search: p / rho^2 of the last step, times this step. Thread: slot.
struct TakeMotion {
  StepTime time;
  View<const Index> order;
  View<const Vec3f> v_m_s;
  View<const float> last_push;
  View<LiquidMotion> motion;
  View<float> found;
  TACTUS_HD void load() { time.load(); }
  TACTUS_HD void operator()(Index i) const {
    const float k = time.dt_s * last_push[order[i]];
    motion[i] = {v_m_s[order[i]], k};
    found[i] = k;
  }
};

/// What a particle's neighbours bring to it, in the kernels' own units. Walls come later.
struct alignas(16) DfsphSums {
  Vec3f slopes;      ///< sum_j -W' / r d
  float shapes = 0;  ///< sum_j W
  float square = 0;  ///< sum_j (W')^2
  float rate = 0;    ///< sum_j -W' / r (v_i - v_j) . d
  float apart2 = 0;  ///< the largest |v_i - v_j|^2
};

/// DfsphSums, which need no more than the particles: they are made while walls still move.
struct DfsphNeighbours {
  static constexpr int kAtOnce = 4;
  template <int kLanes>
  struct Own {
    float vx[kLanes], vy[kLanes], vz[kLanes];
    float sum[kLanes], x[kLanes], y[kLanes], z[kLanes], square[kLanes], rate[kLanes], apart2[kLanes];
  };
  LiquidConstants liquid;
  View<const LiquidMotion> motion;
  View<DfsphSums> sums;

  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    const Vec3f v = motion[i].v_m_s;
    own.vx[t] = v.x, own.vy[t] = v.y, own.vz[t] = v.z;
    own.sum[t] = own.x[t] = own.y[t] = own.z[t] = own.square[t] = own.rate[t] = own.apart2[t] = 0;
  }
  TACTUS_HD float weight(float r2_m2, bool near) const { return pair_slope(liquid, r2_m2, near); }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near, float slope) const {
    const Vec3f v = load_constant(motion, j).v_m_s;
    const float q = r2_m2 * liquid.inverse_distance_1_m(r2_m2) * liquid.kernel.inverse_d_1_m,
                w = SmoothingKernel::shape(q);
    const float x = own.vx[t] - v.x, y = own.vy[t] - v.y, z = own.vz[t] - v.z;
    own.sum[t] += near ? w : 0.F;
    own.x[t] = fma(slope, d.x, own.x[t]);
    own.y[t] = fma(slope, d.y, own.y[t]);
    own.z[t] = fma(slope, d.z, own.z[t]);
    own.square[t] = fma(slope * slope, r2_m2, own.square[t]);
    own.rate[t] = fma(slope, fma(x, d.x, fma(y, d.y, z * d.z)), own.rate[t]);
    own.apart2[t] = max(own.apart2[t], near ? fma(x, x, fma(y, y, z * z)) : 0.F);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    store_wide(
        sums[i],
        DfsphSums{{own.x[t], own.y[t], own.z[t]}, own.sum[t], own.square[t], own.rate[t], own.apart2[t]});
  }
};

/// Density, D, kappa_v of the velocities of the last step, and the largest speed relative to a neighbour or a
/// wall in reach; and where the surface is. Where liquid is thin, in spray, nothing presses it. Thread: slot.
struct DfsphDensity {
  static constexpr float kThinnest = 0.9F;  ///< over the density at rest
  LiquidConstants liquid;
  StepTime time;
  NearWalls walls;
  View<const Index> order;
  View<const Index> first_copy;  ///< as VisitNeighbours
  View<const LiquidMotion> motion;
  View<const DfsphSums> sums;
  View<float> density_kg_m3, alpha, kappa_v, relative_m_s;
  View<LiquidNormal> surface = {};  ///< with surface tension

  TACTUS_HD void load() { time.load(); }
  TACTUS_HD void operator()(Index i) const {
    if (!first_copy.empty() && order[i] >= first_copy[0]) return;
    const DfsphSums sum = load_wide(sums[i]);
    const float m = liquid.mass_kg, rho0 = liquid.density_kg_m3, scale = m * liquid.kernel.slope_scale_1_m5();
    const Vec3f v = motion[i].v_m_s;
    float rho = m * liquid.kernel.scale_1_m3() * sum.shapes;
    Vec3f gradient = scale * sum.slopes;
    float D = sqr(scale) * sum.square, apart2 = sum.apart2;
    if (const Index n = walls.count[i]; n > 0) {
      rho += rho0 * WallFill::of(walls, i, liquid);
      TACTUS_ROLLED
      for (Index k = 0; k < n; ++k) {
        const NearWall& wall = walls.at(i, k);
        const float f = rho0 * wall.slope_1_m;
        gradient -= f * wall.n;
        D += sqr(f) * m * wall.inverse_mass_1_kg;
        const Vec3f apart = v - wall.velocity_m_s;
        apart2 = max(apart2, dot(apart, apart));
      }
    }
    D += dot(gradient, gradient);
    const float inverse = D * sqr(liquid.spacing_m / rho0) > 1e-6F ? 1.F / D : 0.F;
    const float rate = scale * sum.rate + wall_rate(liquid, walls, i, v, 0);
    const bool presses = rho > kThinnest * rho0 && time.dt_s > 0.F && !time.settles();
    density_kg_m3[i] = rho;
    alpha[i] = inverse;
    relative_m_s[i] = tactus::sqrt(apart2);
    kappa_v[i] = presses ? max(0.F, kJacobiRelaxation * rate * inverse) : 0.F;
    if (!surface.empty()) surface[i] = surface_of(liquid, walls, i, sum.slopes, sum.shapes);
  }
};

/// v* = v + dt (viscosity, artificial viscosity, gravity, another acceleration a), with the pair pressure of
/// kappa_v; and the velocity of the first k. The walls' pressure of kappa_v is added with that of k, so that
/// walls get the impulses of both.
template <bool kThins>
struct DfsphForce {
  static constexpr int kAtOnce = 4;
  template <int kLanes>
  struct Own {
    float vx[kLanes], vy[kLanes], vz[kLanes], kappa_v[kLanes], k[kLanes], nu[kThins ? kLanes : 1];
    float ax[kLanes], ay[kLanes], az[kLanes], x[kLanes], y[kLanes], z[kLanes];
  };
  LiquidConstants liquid;
  StepTime time;
  NearWalls walls;
  View<const LiquidMotion> motion;
  View<const float> kappa_v;
  View<LiquidMotion> v_star, moved;
  View<const float> shear_m2_s = {};  ///< kThins

  TACTUS_HD void load() {
    time.load();
    if (time.settles()) time.dt_s = 0;
  }
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    const LiquidMotion m = motion[i];
    own.vx[t] = m.v_m_s.x, own.vy[t] = m.v_m_s.y, own.vz[t] = m.v_m_s.z;
    own.kappa_v[t] = kappa_v[i];
    own.k[t] = m.push;
    if constexpr (kThins) own.nu[t] = shear_m2_s[i];
    own.ax[t] = own.ay[t] = own.az[t] = own.x[t] = own.y[t] = own.z[t] = 0;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float r2_m2, bool near) const {
    const LiquidMotion m = load_constant(motion, j);
    const PairViscosity pair = PairViscosity::of(liquid, r2_m2);
    const float x = m.v_m_s.x - own.vx[t], y = m.v_m_s.y - own.vy[t], z = m.v_m_s.z - own.vz[t];
    const float apart = fma(x, d.x, fma(y, d.y, z * d.z)) * (pair.inverse_r * pair.inverse_r);
    float nu = liquid.shear_m2_s;
    if constexpr (kThins) nu = 0.5F * (own.nu[t] + shear_m2_s[j]);
    const float viscous =
        time.dt_s * fma(pair.slope * liquid.damping_m2_s, min(0.F, apart), nu * pair.weight * apart);
    const float all = fma(pair.slope, -liquid.density_kg_m3 * (own.kappa_v[t] + kappa_v[j]), viscous);
    const float along = near ? all : 0.F, push = near ? pair.slope * (own.k[t] + m.push) : 0.F;
    own.ax[t] = fma(along, d.x, own.ax[t]);
    own.ay[t] = fma(along, d.y, own.ay[t]);
    own.az[t] = fma(along, d.z, own.az[t]);
    own.x[t] = fma(push, d.x, own.x[t]);
    own.y[t] = fma(push, d.y, own.y[t]);
    own.z[t] = fma(push, d.z, own.z[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i, Vec3f a_m_s2 = {}) const {
    const float scale = liquid.mass_kg * liquid.kernel.slope_scale_1_m5();
    const Vec3f v = Vec3f{own.vx[t], own.vy[t], own.vz[t]} + time.dt_s * (time.gravity_m_s2 + a_m_s2) +
                    (scale / liquid.density_kg_m3) * Vec3f{own.ax[t], own.ay[t], own.az[t]};
    v_star[i] = {v, own.k[t]};
    moved[i] = {v - scale * Vec3f{own.x[t], own.y[t], own.z[t]} +
                    wall_correction(liquid, walls, i, own.kappa_v[t] + own.k[t], time),
                own.k[t]};
  }
};

/// The velocity of k; the last time, the step itself.
template <bool kSteps>
struct DfsphVelocity {
  template <int kLanes>
  struct Own {
    float push[kLanes], x[kLanes], y[kLanes], z[kLanes];
  };
  LiquidConstants liquid;
  StepTime time;
  NearWalls walls;
  View<const float> kappa_v;
  View<const LiquidMotion> v_star;
  View<LiquidMotion> moved;  ///< not in the last
  // in the last:
  View<const SearchParticle> particles = {};
  View<const LiquidMotion> motion = {};  ///< before the step
  LiquidStepped stepped = {};
  View<float> last_push = {};  ///< p / rho^2
  View<const float> density_kg_m3 = {}, alpha = {};
  float share = 0;  ///< k that iterations add for a density error: DfsphPressure::share

  TACTUS_HD void load() {
    time.load();
    if (time.settles()) time.dt_s = 0;
  }
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    own.push[t] = v_star[i].push;
    own.x[t] = own.y[t] = own.z[t] = 0;
  }
  TACTUS_HD float weight(float r2_m2, bool near) const { return pair_slope(liquid, r2_m2, near); }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float, bool, float slope) const {
    const float along = slope * (own.push[t] + v_star[j].push);
    own.x[t] = fma(along, d.x, own.x[t]);
    own.y[t] = fma(along, d.y, own.y[t]);
    own.z[t] = fma(along, d.z, own.z[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    const float scale = liquid.mass_kg * liquid.kernel.slope_scale_1_m5(), push = own.push[t];
    const Vec3f v = v_star[i].v_m_s - scale * Vec3f{own.x[t], own.y[t], own.z[t]};
    if constexpr (kSteps) {
      last_push[i] = time.dt_s > 0.F ? kept(i, push, motion[i].push) / time.dt_s : 0.F;
      stepped.end(liquid, walls, particles[i], i, kappa_v[i] + push, motion[i].v_m_s, time, v);
    } else {
      moved[i] = {v + wall_correction(liquid, walls, i, kappa_v[i] + push, time), push};
    }
  }

 private:
  /// Larger errors of the density come from blows. While they last, k may grow.
  static constexpr float kMostKept = 0.01F;
  /// The k with which the next step begins: without the part that the iterations added because the density
  /// was wrong. (A start with that part, too, would add up the density's error over steps. Velocities add up
  /// accelerations, and densities velocities, so waves that the iterations don't find in one step, the long
  /// ones, would swing higher and higher.) The part is known for long waves alone, so no more is taken away
  /// than came in this step.
  TACTUS_HD float kept(Index i, float push, float first) const {
    const float rho0 = liquid.density_kg_m3, rho = density_kg_m3[i];
    if (!(push > 0.F && rho > DfsphDensity::kThinnest * rho0)) return 0.F;
    const float most = kMostKept * rho0,
                added = share * clamp(rho - rho0, -most, most) * alpha[i] / time.dt_s;
    return clamp(push - added, min(push, first), max(push, first));
  }
};

/// One Jacobi step of all k.
struct DfsphPressure {
  static constexpr float kMomentum = 0.5F;
  /// Liquid of more than so many rho0 is squeezed: k takes smaller steps there, without momentum (eigenvalues
  /// up to 6.7). Else what implodes under its tension stays pressed together, at up to eleven rho0.
  static constexpr float kSqueezed = 1.03F, kCareful = 0.6F;
  /// The relative density error that a step may undo: liquid that is squeezed more, in a cut that shuts, must
  /// not be shot out of it. An error e that is undone in dt gives neighbours the speed e d / (3 dt). So e may
  /// grow with dt: the speed is that of 0.1 in the shortest step, 0.4 d / v_max.
  TACTUS_HD static float most_mended(const LiquidConstants& liquid, float dt_s) {
    return max(0.1F, 0.25F * liquid.max_speed_m_s * dt_s / liquid.spacing_m);
  }
  /// The k that a constant `excess` adds in so many iterations, where neighbours' k change alike: over D^-1
  /// excess / dt.
  static float share(int iterations) {
    float k = 0, found = 0;
    for (int i = 1; i <= iterations; ++i) {
      const float next = k + kJacobiRelaxation;
      k = i == iterations ? next : next + kMomentum * (next - found);
      found = next;
    }
    return k;
  }
  template <int kLanes>
  struct Own {
    float vx[kLanes], vy[kLanes], vz[kLanes], sum[kLanes];
  };
  LiquidConstants liquid;
  StepTime time;
  NearWalls walls;
  View<const float> kappa_v;
  View<const LiquidMotion> moved;
  View<const float> density_kg_m3, alpha;
  View<float> found;  ///< k without momentum
  View<LiquidMotion> v_star;
  bool is_last;

  TACTUS_HD void load() { time.load(); }
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    const Vec3f v = moved[i].v_m_s;
    own.vx[t] = v.x, own.vy[t] = v.y, own.vz[t] = v.z;
    own.sum[t] = 0;
  }
  TACTUS_HD float weight(float r2_m2, bool near) const { return pair_slope(liquid, r2_m2, near); }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f d, float, bool, float slope) const {
    const LiquidMotion m = load_constant(moved, j);
    const float x = own.vx[t] - m.v_m_s.x, y = own.vy[t] - m.v_m_s.y, z = own.vz[t] - m.v_m_s.z;
    own.sum[t] = fma(slope, fma(x, d.x, fma(y, d.y, z * d.z)), own.sum[t]);
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    if (!(time.dt_s > 0.F)) return;
    const Vec3f v{own.vx[t], own.vy[t], own.vz[t]};
    const float push = v_star[i].push, rate = liquid.mass_kg * liquid.kernel.slope_scale_1_m5() * own.sum[t] +
                                              wall_rate(liquid, walls, i, v, kappa_v[i] + push);
    const float rho0 = liquid.density_kg_m3, rho = density_kg_m3[i],
                excess = min(rho, (1.F + most_mended(liquid, time.dt_s)) * rho0) - rho0 + time.dt_s * rate;
    const bool is_squeezed = rho > kSqueezed * rho0;
    const float omega = is_squeezed ? kCareful * kJacobiRelaxation : kJacobiRelaxation,
                k = max(0.F, push + omega * excess * alpha[i] / time.dt_s);
    v_star[i].push = is_last || is_squeezed ? k : max(0.F, k + kMomentum * (k - found[i]));
    found[i] = k;
  }
};

}  // namespace tactus
