#include "tactus/tissue/hybrid/deflection_match.h"

#include <algorithm>
#include <cmath>

namespace tactus {

double compliance(ExecContext& ctx, Hybrid& body, const CubeLattice& lattice, Vec3f down) {
  const Vec3f extent = lattice.spacing_m * vec_cast<float>(lattice.node_dims - Vec3i{1, 1, 1});
  // Waves cross the body in its length over their speed; a weight that strains a column of this length by
  // 3e-4 bends a beam ten times as long as thick by 5 % of its length.
  const float longest = std::max({extent.x, extent.y, extent.z});
  const float dt_s = body.stable_step_s(), speed_m_s = lattice.spacing_m / dt_s;
  const float weight_m_s2 = 3e-4F * speed_m_s * speed_m_s / longest;
  const BodyStep step{.dt_s = dt_s, .gravity_m_s2 = weight_m_s2 * down};
  BodyState state = rest_state(ctx, lattice);
  const std::vector<Vec3f> rest = lattice.rest_positions_m();
  const auto work_J = [&] {
    const std::vector<Vec3f> x = to_host(ctx, state.x_m.const_view());
    double sum = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
      sum += double{lattice.node_mass_kg[i]} * double{weight_m_s2} * double{dot(down, x[i] - rest[i])};
    return sum;
  };
  const auto kinetic_J = [&] {
    const std::vector<Vec3f> v = to_host(ctx, state.v_m_s.const_view());
    double sum = 0;
    for (std::size_t i = 0; i < v.size(); ++i)
      sum += 0.5 * double{lattice.node_mass_kg[i]} * double{dot(v[i], v[i])};
    return sum;
  };
  // Where kinetic energy peaks, potential energy is least along the way: stop there and start again.
  constexpr int kMostPieces = 4000, kSteps = 20, kPeaks = 40;
  double before = 0, last_work = 0;
  int peaks = 0;
  for (int piece = 0; piece < kMostPieces && peaks < kPeaks; ++piece) {
    body.step(ctx, state, step, kSteps);
    const double now = kinetic_J();
    if (now < before) {
      ctx.fill_bytes(state.v_m_s.view(), 0);
      const double work = work_J();
      if (peaks > 2 && std::abs(work - last_work) < 1e-4 * std::abs(work)) break;
      last_work = work;
      ++peaks;
    }
    before = now < before ? 0 : now;
  }
  return work_J() / (double{weight_m_s2} * double{weight_m_s2});
}

float match_deflection(ExecContext& ctx, const BodyModel& model, Vec3f down) {
  const CubeLattice& lattice = model.lattice;
  const std::span<const std::uint8_t> elements = model.elements;
  const bool held =
      std::any_of(lattice.fixed.begin(), lattice.fixed.end(), [](std::uint8_t f) { return f != 0; });
  const bool matched = std::any_of(elements.begin(), elements.end(), [](std::uint8_t e) { return e == 0; });
  if (!held || !matched) return 1;
  const auto test = [&](std::span<const std::uint8_t> mask, float scale) {
    BodyModel scaled = model;
    scaled.elements = mask;
    scaled.flsm.stiffness_scale = scale;
    Hybrid body(ctx, scaled);
    return compliance(ctx, body, lattice, down);
  };
  // Elements and shape matching give way one after the other: compliance is a + b / scale.
  const double wanted = test({}, 1), once = test(elements, 1), twice = test(elements, 2);
  const double b = 2 * (once - twice), a = once - b;
  return static_cast<float>(wanted > a ? std::clamp(b / (wanted - a), 0.25, 4.0) : 4.0);
}

}  // namespace tactus
