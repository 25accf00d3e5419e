/// Shape matching at a coarser rate than elements.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/tissue/hybrid/hybrid.h"

namespace tactus {
namespace {

constexpr ElasticMaterial kMaterial{.young_Pa = 30000, .poisson = 0.45F};

/// 0.1 x 0.02 x 0.02 m, elements for 0.6 of its length.
struct Beam {
  explicit Beam(bool clamped, float damping = 0.1F) : set("cpu") {
    lattice = lattice_from_box({0, 0, 0}, {20, 4, 4}, {.spacing_m = 0.005F});
    if (clamped) lattice.fix_half_space({5e-5F, 0, 0}, {1, 0, 0});
    model.emplace(ctx(), lattice, split_by_ratio(lattice, 0, 6, 4), std::span(&kMaterial, 1),
                  std::span<const std::uint8_t>{}, TledOptions{.damping_ratio = damping},
                  FlsmMaterial{.young_Pa = 30000, .half_width = 3, .damping_ratio = damping});
    body = rest_state(ctx(), lattice);
  }
  ExecContext& ctx() { return set.context(0); }
  /// Heights of the middle of the free end, every `every` substeps.
  std::vector<float> tip_m(int steps, int every, HybridStep step) {
    std::vector<float> z;
    for (int k = 0; k < steps; k += every) {
      model->step(ctx(), body, step, every);
      const auto x = to_host(ctx(), body.x_m.const_view());
      for (std::size_t i = 0; i < x.size(); ++i)
        if (lattice.nodes[i] == Vec3i{20, 2, 2}) z.push_back(x[i].z);
    }
    return z;
  }
  DeviceSet set;
  CubeLattice lattice;
  std::optional<Hybrid> model;
  BodyState body;
};

/// At rest goals don't change, so that their rate doesn't matter: the same deflection to what is left of the
/// motion after 2 s of drag 20/s.
TEST(HybridRate, RestsWhereItDoesInLockStep) {
  float tip[2];
  for (const int every : {1, 4}) {
    Beam beam(true);
    const float dt = beam.model->stable_step_s();
    const int steps = static_cast<int>(2.F / dt) / 4 * 4;
    tip[every == 1 ? 0 : 1] =
        beam.tip_m(steps, 4,
                   {.dt_s = dt, .gravity_m_s2 = {0, 0, -9.81F}, .drag_per_s = 20, .matched_every = every})
            .back() -
        0.01F;
  }
  std::printf("tip in lock-step %.5f m, at a quarter of the rate %.5f m\n", static_cast<double>(tip[0]),
              static_cast<double>(tip[1]));
  EXPECT_LT(tip[0], -0.05F);
  EXPECT_NEAR(tip[1] / tip[0], 1, 2e-3);
}

/// It swings in the same time: from the release to the lowest point, half a period, within 2 % (an explicit
/// step of shape matching is at most 1/omega long, a 1/60 of the beam's period).
TEST(HybridRate, SwingsInTheSameTime) {
  int lowest[2];
  for (const int every : {1, 4}) {
    Beam beam(true, 0.02F);
    const auto z = beam.tip_m(
        1600, 4,
        {.dt_s = beam.model->stable_step_s(), .gravity_m_s2 = {0, 0, -0.5F}, .matched_every = every});
    lowest[every == 1 ? 0 : 1] = static_cast<int>(std::min_element(z.begin(), z.end()) - z.begin());
  }
  std::printf("lowest after %d and %d times 4 substeps\n", lowest[0], lowest[1]);
  EXPECT_GT(lowest[0], 20);
  EXPECT_LT(lowest[0], 380);
  EXPECT_NEAR(lowest[1], lowest[0], 0.02 * lowest[0] + 1);
}

/// Goals pull all nodes at once, and in pairs: momentum is kept as in lock-step.
TEST(HybridRate, KeepsMomentum) {
  Beam beam(false, 0);
  std::vector<Vec3f> v(beam.lattice.nodes.size(), Vec3f{0.5F, 0, 0});
  for (std::size_t i = 0; i < v.size(); ++i) v[i].z = 0.05F * static_cast<float>(beam.lattice.nodes[i].x % 7);
  beam.body.v_m_s = to_device(beam.ctx(), v);
  const float dt = beam.model->stable_step_s();
  beam.model->step(beam.ctx(), beam.body, {.dt_s = dt, .gravity_m_s2 = {}, .matched_every = 4},
                   static_cast<int>(1 / dt) / 4 * 4);
  const auto after = to_host(beam.ctx(), beam.body.v_m_s.const_view());
  Vec3d change{};
  double largest = 0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    change += static_cast<double>(beam.lattice.node_mass_kg[i]) * vec_cast<double>(after[i] - v[i]);
    largest = std::max(largest, static_cast<double>(length(after[i])));
  }
  EXPECT_LT(largest, 3);
  // One rounding of v a substep for 3000 of them, random: 6e-8 sqrt(3000) = 3e-6 of the largest speed.
  EXPECT_LT(length(change) / (beam.lattice.mass_kg() * largest), 1e-5);
}

TEST(HybridRate, CountsThatDontDivideAreRefused) {
  Beam beam(true);
  const float dt = beam.model->stable_step_s();
  EXPECT_GE(beam.model->most_matched_every(dt), 4);
  EXPECT_THROW(beam.model->step(beam.ctx(), beam.body, {.dt_s = dt, .matched_every = 3}, 4), Error);
  EXPECT_THROW(beam.model->step(beam.ctx(), beam.body, {.dt_s = dt, .matched_every = 0}, 4), Error);
}

}  // namespace
}  // namespace tactus
