#pragma once
/// How damping shortens a stable step.
#include <cmath>

namespace tactus {

/// With damping time b the step of a mode omega must stay below (2/omega) (sqrt(1 + z^2) - z), z = b omega/2.
inline float damped_step_s(float undamped_step_s, float damping_time_s) {
  const float z = damping_time_s / undamped_step_s;
  return undamped_step_s * (std::sqrt(1 + z * z) - z);
}

}  // namespace tactus
