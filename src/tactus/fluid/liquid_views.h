#pragma once
/// What kernels see of a liquid.
#include "tactus/fluid/smoothing_kernel.h"
#include "tactus/fluid/viscosity.h"
#include "tactus/frame/frame_params.h"
#include "tactus/geom/near_walls.h"

namespace tactus {

/// What neighbours read of a particle in one go.
struct alignas(16) LiquidMotion {
  Vec3f v_m_s;
  float push = 0;  ///< p / rho^2 [m^5 / (kg s^2)]
};

/// Numbers that follow from the settings.
struct LiquidConstants {
  SmoothingKernel kernel;
  float spacing_m = 0;  ///< d
  float mass_kg = 0;    ///< rho0 d^3
  float density_kg_m3 = 0;
  float tait_Pa = 0;       ///< rho0 c^2 / 7
  float sound_m_s = 0;     ///< c
  float shear_m2_s = 0;    ///< kinematic viscosity; the largest, where it depends on the shear rate
  float damping_m2_s = 0;  ///< alpha c d of the artificial viscosity
  float closest_m = 0;     ///< no particle's middle is nearer to a wall
  float tension_N_m = 0;   ///< sigma
  float contact_cos = 0, contact_sin = 1;
  CarreauLaw thinning;  ///< where viscosity depends on the shear rate
};

/// What all walls near a particle bring to its density, over that at rest. What is behind two walls at an
/// edge overlaps: 1 - (1 - fill_1)(1 - fill_2), which misses the lattice's edge by 0.004. What is behind two
/// walls that face each other does not: fill_1 + fill_2. Between, with across = -n_1 . n_2 (at least 0),
///
///   fill = 1 - prod_k (1 - fill_k) + sum_k<l across_kl fill_k fill_l prod_m (1 - fill_m)     (m not k, l),
///
/// which has both for three walls, too: a gap with a floor is 1 - (1 - fill_1 - fill_2)(1 - fill_3).
struct WallFill {
  /// Sets `slope_1_m` of the walls, too: positions stay for a step, so the first who asks keeps it for all.
  ///
  /// Nearer than `closest_m`, where a particle is put back, the fill goes on linearly. A wall that gives way
  /// is softer: pressure and a light node would else swing faster than the step can follow. As density and
  /// force are softened alike, energy is kept.
  TACTUS_HD static float of(const NearWalls& near, Index i, const LiquidConstants& liquid) {
    const Index n = near.count[i];
    float own[kNearWalls], open[kNearWalls], all_open = 1;
    for (Index k = 0; k < n; ++k) {
      NearWall& wall = near.at(i, k);
      const float s = wall.distance_m, in = max(liquid.closest_m - s, 0.F),
                  soft = 1.F / tactus::sqrt(1.F + liquid.mass_kg * wall.give_1_kg),
                  slope = soft * liquid.kernel.fill_slope_1_m(s + in);
      own[k] = soft * liquid.kernel.fill(s + in) + in * slope;
      open[k] = max(1.F - own[k], 0.F);
      all_open *= 1.F - own[k];
      wall.slope_1_m = slope;
    }
    float grows[kNearWalls];  // with own[k]
    for (Index k = 0; k < n; ++k) {
      grows[k] = 1.F;
      for (Index l = 0; l < n; ++l) grows[k] *= l == k ? 1.F : open[l];
    }
    float fill = 1.F - all_open;
    for (Index k = 0; k + 1 < n; ++k)
      for (Index l = k + 1; l < n; ++l) fill += add_across(near, i, k, l, own, open, grows);
    for (Index k = 0; k < n; ++k) near.at(i, k).slope_1_m *= grows[k];
    return fill;
  }

 private:
  /// What walls k and l have more because they face each other; `grows` gets its slopes.
  TACTUS_HD static float add_across(const NearWalls& near, Index i, Index k, Index l, const float* own,
                                    const float* open, float* grows) {
    const float across = max(-dot(near.at(i, k).n, near.at(i, l).n), 0.F);
    if (!(across > 0.F)) return 0;
    float others = 1;
    for (Index m = 0; m < near.count[i]; ++m) others *= m == k || m == l ? 1.F : open[m];
    grows[k] += across * own[l] * others;
    grows[l] += across * own[k] * others;
    if (near.count[i] > 2) {
      for (Index m = 0; m < near.count[i]; ++m) {
        float rest = 1;
        for (Index o = 0; o < near.count[i]; ++o) rest *= o == k || o == l || o == m ? 1.F : open[o];
        grows[m] -= m == k || m == l ? 0.F : across * own[k] * own[l] * rest;
      }
    }
    return across * own[k] * own[l] * others;
  }
};

/// dt p / rho^2 with which a wall pushes a particle that has `push` itself: p is that at the wall, a distance
/// s deeper or higher in a liquid that rests, p_i - rho g . n s. (The missing layer's pressure would be p_i -
/// 2 rho g . n s, and the wall stands for both sides of its pairs.)
/// @param falls_m_s dt g
TACTUS_HD inline float push_at_wall(const LiquidConstants& liquid, const NearWall& wall, float push,
                                    Vec3f falls_m_s) {
  const float deeper = -dot(falls_m_s, wall.n) * max(wall.distance_m, liquid.closest_m);
  return max(0.F, push + deeper / liquid.density_kg_m3);
}

}  // namespace tactus
