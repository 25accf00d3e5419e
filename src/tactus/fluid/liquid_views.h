#pragma once
/// Data of a liquid that its kernels read.
#include "tactus/fluid/smoothing_kernel.h"
#include "tactus/fluid/viscosity.h"
#include "tactus/frame/frame_params.h"
#include "tactus/geom/search/near_walls.h"

namespace tactus {

/// Data of a particle that neighbours read in one go.
struct alignas(16) LiquidMotion {
  Vec3f v_m_s;
  float push = 0;  ///< p / rho^2 [m^5 / (kg s^2)]
};

/// A surface as particles see it.
struct alignas(16) LiquidNormal {
  Vec3f n;         ///< into the liquid, unit; before it is smoothed g d over sum_j V W
  float size = 0;  ///< |m| d; 0 inside the liquid
};

/// Numbers that follow from the settings.
struct LiquidConstants {
  SmoothingKernel kernel;
  float spacing_m = 0;  ///< d
  float mass_kg = 0;    ///< rho0 d^3
  float density_kg_m3 = 0;
  float tait_Pa = 0;        ///< rho0 c^2 / 7
  float max_speed_m_s = 0;  ///< or that of the surface's shortest waves
  float sound_m_s = 0;      ///< c
  float shear_m2_s = 0;     ///< kinematic viscosity; the largest, where it depends on the shear rate
  float damping_m2_s = 0;   ///< alpha c d of the artificial viscosity
  float closest_m = 0;      ///< no particle's middle is nearer to a wall
  float tension_N_m = 0;    ///< sigma
  float contact_cos = 0, contact_sin = 1;
  float impulse_unit_N_s = 0;  ///< of sums of impulses on walls; a power of two
  CarreauLaw thinning;         ///< where viscosity depends on the shear rate

  /// 1 / r, and something finite of a particle and itself.
  TACTUS_HD float inverse_distance_1_m(float r2_m2) const {
    return 1.F / tactus::sqrt(max(r2_m2, 1e-12F * sqr(spacing_m)));
  }
};

}  // namespace tactus
