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

/// What all walls near a particle bring to its density, over that at rest. Two walls at an edge overlap:
/// 1 - (1 - fill_1)(1 - fill_2), which misses the lattice's edge by 0.004.
struct WallShare {
  float fill = 0;
  float slope_1_m[kNearWalls];  ///< minus the slope of `fill` along each wall's normal
  /// Nearer than `closest_m`, where a particle is put back, the fill goes on linearly. A wall that gives way
  /// is softer: pressure and a light node would else swing faster than the step can follow. As density and
  /// force are softened alike, energy is kept.
  TACTUS_HD static WallShare of(const NearWalls& near, Index i, const LiquidConstants& liquid) {
    WallShare share;
    const Index n = near.count[i];
    float open[kNearWalls], all_open = 1;
    for (Index k = 0; k < n; ++k) {
      const float s = near.at(i, k).distance_m, in = max(liquid.closest_m - s, 0.F),
                  soft = 1.F / tactus::sqrt(1.F + liquid.mass_kg * near.at(i, k).give_1_kg),
                  slope = soft * liquid.kernel.fill_slope_1_m(s + in);
      open[k] = 1.F - (soft * liquid.kernel.fill(s + in) + in * slope);
      all_open *= open[k];
      share.slope_1_m[k] = slope;
    }
    for (Index k = 0; k < n; ++k) {
      for (Index l = 0; l < n; ++l) share.slope_1_m[k] *= l == k ? 1.F : max(open[l], 0.F);
    }
    share.fill = 1.F - all_open;
    return share;
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
