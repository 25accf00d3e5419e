// The stable step of a body, measured.
#include <algorithm>
#include <cmath>
#include <random>

#include "tactus/tissue/tled/damped_step.h"
#include "tactus/tissue/tled/tled.h"

namespace tactus {

// The largest eigenvalue of M^-1 K, K from forces of small displacements. Round-off limits the quotient to
// about 1 %, which the factor of 0.95 covers.
float Tled::measure_stable_step(ExecContext& ctx, const CubeLattice& lattice, int iterations) {
  const std::vector<Vec3f> rest = lattice.rest_positions_m();
  BodyState state = rest_state(ctx, lattice);
  std::vector<Vec3f> d(rest.size()), x(rest.size());
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (Vec3f& p : d) p = {uniform(random), uniform(random), uniform(random)};
  double eigenvalue = 0;
  const float size = 1e-3F * spacing_m_;
  for (int k = 0; k < iterations; ++k) {
    float largest = 0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      d[i] = free_part(d[i], lattice.fixed[i]);
      largest = std::max(largest, length(d[i]));
    }
    for (std::size_t i = 0; i < d.size(); ++i) {
      d[i] = (size / largest) * d[i];
      x[i] = rest[i] + d[i];
      d[i] = x[i] - rest[i];
    }
    state.x_m = to_device(ctx, x);
    compute_forces(ctx, state);
    const std::vector<Vec3f> f = forces_N(ctx);
    double over = 0, under = 0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      if (lattice.fixed[i] == kAllAxes) continue;
      over -= static_cast<double>(dot(d[i], f[i]));
      under += static_cast<double>(lattice.node_mass_kg[i]) * static_cast<double>(dot(d[i], d[i]));
      d[i] = (-1 / lattice.node_mass_kg[i]) * f[i];
    }
    eigenvalue = std::max(eigenvalue, over / under);
  }
  const float undamped = static_cast<float>(2 / std::sqrt(eigenvalue));
  stable_step_s_ = 0.95F * damped_step_s(undamped, damping_time_s_);
  return stable_step_s_;
}

}  // namespace tactus
