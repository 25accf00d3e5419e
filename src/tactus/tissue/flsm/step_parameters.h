#pragma once
/// Parameters of a step of shape matching, for kernels.
#include "tactus/frame/frame_params.h"

namespace tactus::flsm {

/// How stiff and how damped a step of shape matching is: both depend on its length.
struct StepParameters {
  float omega_per_s, damping_ratio;
  Index full_stiffness;  ///< 1: kappa = 1, the paper's choice
  Index substeps;        ///< that one step of shape matching covers
  TACTUS_HD float dt_s(const StepTime& substep) const { return substep.dt_s * static_cast<float>(substeps); }
  TACTUS_HD float kappa(float dt_s) const {
    return full_stiffness != 0 ? 1.F : min(1.F, sqr(omega_per_s * dt_s));
  }
  /// 2 ratio / omega of the stiffness that is really applied, sqrt(kappa) / dt: a fixed time would make short
  /// steps at full stiffness unstable (the limit is kappa (1 + 2 time / dt) <= 4).
  TACTUS_HD float damping_time_s(float dt_s) const { return 2 * damping_ratio * dt_s / sqrt(kappa(dt_s)); }
};

}  // namespace tactus::flsm
