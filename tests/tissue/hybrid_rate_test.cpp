/// Shape matching at a coarser rate than elements.
#include <gtest/gtest.h>

#include <algorithm>
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
    model.emplace(ctx(), BodyModel{.lattice = lattice,
                                   .elements = split_by_ratio(lattice, 0, 6, 4),
                                   .materials = {&kMaterial, 1},
                                   .tled = {.damping_ratio = damping},
                                   .flsm = {.young_Pa = 30000, .half_width = 3, .damping_ratio = damping}});
    body = rest_state(ctx(), lattice);
  }
  ExecContext& ctx() { return set.context(0); }
  /// Heights of the middle of the free end, every `every` substeps.
  std::vector<float> tip_m(int steps, int every, BodyStep step) {
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

// What a coarser rate changes: between two impulses, n substeps apart, nodes of both models are pulled by the
// elements alone, with an acceleration a. They go round a cycle of the speeds -(n-1)/2 a dt .. (n-1)/2 a dt;
// where goals are made they stand (n^2-1)/12 a dt^2 off their mean, and damping, which looks tau = 2
// ratio/omega ahead, sees (n-1)/2 tau a dt more. So the matched part is held c = ((n^2-1)/12 + (n-1)/2
// tau/dt) a dt^2 off the place where the elements feel these nodes. Bending gives the outermost of them a =
// (M H/2 / I) / (rho h), with H = 0.02 m, I = H^4/12, h = 0.005 m a layer's thickness, so the matched part
// turns by c / (H/2).

/// M = 0.157 N, the matched part's weight, times 0.01 m, half its extent once it hangs down: a = 235 m/s^2.
/// With n = 4, dt = 0.261 ms and tau = 0.97 dt, c = 2.7 a dt^2 = 0.043 mm turns it by 0.0043, which moves its
/// tip, 0.02 m away, by 0.087 mm: 0.12 % of 73 mm. 0.09 % are measured, 0.02 % with n = 2; twice it is
/// allowed. Of the motion nothing is left: drag of 20/s damps e^-20 in 2 s.
TEST(HybridRate, RestsWhereItDoesInLockStep) {
  float tip[2];
  for (const int every : {1, 4}) {
    Beam beam(true);
    const float dt = beam.model->stable_step_s();
    const int steps = static_cast<int>(2.F / dt) / 4 * 4;
    tip[every == 1 ? 0 : 1] =
        beam.tip_m(steps, 4,
                   {.dt_s = dt, .gravity_m_s2 = {0, 0, -9.81F}, .drag_per_s = 20, .matching_every = every})
            .back() -
        0.01F;
  }
  std::printf("tip in lock-step %.5f m, at a quarter of the rate %.5f m\n", static_cast<double>(tip[0]),
              static_cast<double>(tip[1]));
  EXPECT_LT(tip[0], -0.05F);
  EXPECT_NEAR(tip[1] / tip[0], 1, 2e-3);
}

/// Index of the least value, between samples by the parabola through the three next to it.
double lowest_at(const std::vector<float>& z) {
  const auto least = std::min_element(z.begin() + 1, z.end() - 1);
  const auto before = static_cast<double>(least[-1]), here = static_cast<double>(*least),
             behind = static_cast<double>(least[1]);
  return static_cast<double>(least - z.begin()) + 0.5 * (before - behind) / (before - 2 * here + behind);
}

/// It swings in the same time, from the release to the lowest point: half a period. M = 0.008 N times 0.02 m
/// gives a = 24 m/s^2; with dt = 0.283 ms and tau = 0.18 dt, c = 1.5 a dt^2 = 2.9 um turns the matched part
/// by 2.9e-4 and its tip, 0.04 m away, by 0.012 mm: 0.19 % of the 6.2 mm about which it swings. A beam so
/// much stiffer is 0.1 % faster. 0.09 % are measured, a quarter of a sample; twice the 0.1 % is allowed. The
/// rest is small: an explicit step of 4 dt shortens the period by (2 pi 4 dt/T)^2/24 = 6e-6 of T = 0.58 s; at
/// the minimum z bends by 0.8 um a sample squared and is known to 1e-9 m (float), which moves it by 0.001
/// samples, 5e-6 of the time.
TEST(HybridRate, SwingsInTheSameTime) {
  double lowest[2];
  for (const int every : {1, 4}) {
    Beam beam(true, 0.02F);
    const auto z = beam.tip_m(
        1600, 4,
        {.dt_s = beam.model->stable_step_s(), .gravity_m_s2 = {0, 0, -0.5F}, .matching_every = every});
    lowest[every == 1 ? 0 : 1] = lowest_at(z);
  }
  std::printf("lowest after %.2f and %.2f times 4 substeps\n", lowest[0], lowest[1]);
  EXPECT_GT(lowest[0], 20);
  EXPECT_LT(lowest[0], 380);
  EXPECT_NEAR(lowest[1] / lowest[0], 1, 2e-3);
}

/// Goals pull all nodes at once, and in pairs: momentum is kept as in lock-step.
TEST(HybridRate, KeepsMomentum) {
  Beam beam(false, 0);
  std::vector<Vec3f> v(beam.lattice.nodes.size(), Vec3f{0.5F, 0, 0});
  for (std::size_t i = 0; i < v.size(); ++i) v[i].z = 0.05F * static_cast<float>(beam.lattice.nodes[i].x % 7);
  beam.body.v_m_s = to_device(beam.ctx(), v);
  const float dt = beam.model->stable_step_s();
  beam.model->step(beam.ctx(), beam.body, {.dt_s = dt, .gravity_m_s2 = {}, .matching_every = 4},
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
  EXPECT_GE(beam.model->most_matching_every(dt), 4);
  EXPECT_THROW(beam.model->step(beam.ctx(), beam.body, {.dt_s = dt, .matching_every = 3}, 4), Error);
  EXPECT_THROW(beam.model->step(beam.ctx(), beam.body, {.dt_s = dt, .matching_every = 0}, 4), Error);
}

}  // namespace
}  // namespace tactus
