#pragma once
/// What kernels see of a liquid.
#include "tactus/fluid/smoothing_kernel.h"
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
  float shear_m2_s = 0;    ///< kinematic viscosity
  float damping_m2_s = 0;  ///< alpha c d of the artificial viscosity
  float closest_m = 0;     ///< no particle's middle is nearer to a wall
};

/// What all walls near a particle bring to its density, over that at rest. Two walls at an edge overlap:
/// 1 - (1 - fill_1)(1 - fill_2), which misses the lattice's edge by 0.004.
struct WallShare {
  float fill = 0;
  float slope_1_m[kNearWalls];  ///< minus the slope of `fill` along each wall's normal
  /// What is behind a wall, or nearer than `closest_m`, is put back there: it counts as if it were there.
  TACTUS_HD static WallShare of(const NearWalls& near, Index i, const LiquidConstants& liquid) {
    const SmoothingKernel& kernel = liquid.kernel;
    WallShare share;
    const Index n = near.count[i];
    float open[kNearWalls], all_open = 1;
    for (Index k = 0; k < n; ++k) {
      open[k] = 1.F - kernel.fill(max(near.at(i, k).distance_m, liquid.closest_m));
      all_open *= open[k];
    }
    for (Index k = 0; k < n; ++k) {
      float others = 1;
      for (Index l = 0; l < n; ++l) others *= l == k ? 1.F : open[l];
      share.slope_1_m[k] = others * kernel.fill_slope_1_m(max(near.at(i, k).distance_m, liquid.closest_m));
    }
    share.fill = 1.F - all_open;
    return share;
  }
};

}  // namespace tactus
