#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "tactus/fluid/liquid.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kSpacing_m = 0.01F, kInner_m = 6 * kSpacing_m, kOuter_m = 16 * kSpacing_m,
                kHeight_m = 5 * kSpacing_m;
constexpr float kSpin_rad_s = 0.1F / kInner_m;
constexpr Index kInner = Liquid::kFaces, kOuter = kInner + 1;

std::vector<LiquidParticle> ring() {
  std::vector<LiquidParticle> particles;
  for (float r = kInner_m + kSpacing_m / 2; r < kOuter_m; r += kSpacing_m) {
    const auto around = static_cast<int>(std::lround(2 * kPi * r / kSpacing_m));
    for (int a = 0; a < around; ++a) {
      const float angle = 2 * kPi * static_cast<float>(a) / static_cast<float>(around);
      for (float z = kSpacing_m / 2; z < kHeight_m; z += kSpacing_m)
        particles.push_back(
            {{r * std::cos(angle), r * std::sin(angle), z}, {}, static_cast<Index>(particles.size())});
    }
  }
  return particles;
}

/// Two cylinders, of which the inner one turns; what closes them above and below is smooth.
void add_cylinders(Liquid& liquid) {
  const NeighbourCells cells = liquid.search().cells();
  const NearWalls walls = liquid.near_walls();
  const float reach_m = liquid.constants().kernel.reach_m();
  for (Index i = 0; i < cells.placed[0]; ++i) {
    const Vec3f x = cells.particles[i].x_m, v = liquid.view().v_m_s[cells.order[i]];
    for (Index k = 0; k < walls.count[i]; ++k) walls.at(i, k).velocity_m_s = {v.x, v.y, 0};
    const float r = std::sqrt(x.x * x.x + x.y * x.y);
    const Vec3f out{x.x / r, x.y / r, 0}, along{-out.y, out.x, 0};
    if (r - kInner_m < reach_m) walls.add(i, {out, r - kInner_m, (kSpin_rad_s * r) * along, kInner, 0.F, {}});
    if (kOuter_m - r < reach_m) walls.add(i, {-1.F * out, kOuter_m - r, {}, kOuter, 0.F, {}});
  }
}

/// [N m] on a cylinder, about its axis. Forces act where the particles are, so what the liquid gets and what
/// the cylinder gives have the same arm.
double torque_N_m(Liquid& liquid, Index collider, float dt_s) {
  const NeighbourCells cells = liquid.search().cells();
  const NearWalls walls = liquid.near_walls();
  double sum = 0;
  for (Index i = 0; i < cells.placed[0]; ++i) {
    for (Index k = 0; k < walls.count[i]; ++k) {
      const NearWall& wall = walls.at(i, k);
      if (wall.collider != collider) continue;
      const Vec3f at = cells.particles[i].x_m;
      sum += double{at.x * wall.impulse_N_s.y - at.y * wall.impulse_N_s.x};
    }
  }
  return sum / double{dt_s};
}

class Couette : public ::testing::TestWithParam<LiquidSolver> {};
INSTANTIATE_TEST_SUITE_P(Solvers, Couette, ::testing::Values(LiquidSolver::wcsph, LiquidSolver::dfsph));

struct Turned {
  double inner_N_m = 0, outer_N_m = 0;
  std::vector<LiquidParticle> particles;
};

/// Turns the inner cylinder until the flow is steady.
Turned turn(LiquidSolver solver, float viscosity_Pa_s, std::optional<Carreau> carreau) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const std::vector<LiquidParticle> particles = ring();
  const float far = 1.2F * kOuter_m;
  Liquid liquid(set, {.solver = solver,
                      .spacing_m = kSpacing_m,
                      .density_kg_m3 = 1000,
                      .viscosity_Pa_s = viscosity_Pa_s,
                      .carreau = carreau,
                      .max_speed_m_s = 0.2F,
                      .artificial_viscosity = 0,
                      .box_m = {{-far, -far, 0}, {far, far, kHeight_m}},
                      .max_particles = static_cast<Index>(particles.size()),
                      .other_walls = 2});
  liquid.place(particles);
  const StepTime time{.dt_s = liquid.largest_step_s(), .gravity_m_s2 = {}};
  Turned result;
  const int steps = static_cast<int>(0.6F / time.dt_s), last = 100;  // gap^2 / (pi^2 nu) = 0.1 s
  for (int i = 0; i < steps; ++i) {
    liquid.begin_step(time);
    ctx.synchronize();
    add_cylinders(liquid);
    liquid.end_step(time);
    ctx.synchronize();
    if (i < steps - last) continue;
    result.inner_N_m -= torque_N_m(liquid, kInner, time.dt_s) / last;
    result.outer_N_m += torque_N_m(liquid, kOuter, time.dt_s) / last;
  }
  result.particles = liquid.particles();
  return result;
}

struct Differences {
  double worst = 0, rms = 0;
};
/// Of velocities around the axis, over that of the cylinder.
template <class Profile>
Differences differences(const Turned& turned, Profile&& speed_m_s) {
  double worst = 0, squares = 0;
  for (const LiquidParticle& p : turned.particles) {
    const Vec3d x = vec_cast<double>(p.x_m), v = vec_cast<double>(p.v_m_s);
    const double r = std::hypot(x.x, x.y), turns = (x.x * v.y - x.y * v.x) / r;
    const double off = (turns - speed_m_s(r)) / double{kSpin_rad_s * kInner_m};
    worst = std::max(worst, std::abs(off));
    squares += off * off / static_cast<double>(turned.particles.size());
  }
  return {worst, std::sqrt(squares)};
}

/// Between a cylinder that turns and one that rests, v = A r + B / r and the torque is 4 pi mu B h: no
/// distance in it depends on a box. 5 %: the walls are half a spacing from the first layers, and what the
/// kernel's integral over a plane makes of a cylinder of 6 d is off by about d / (4 r). The liquid takes from
/// one cylinder what it gives to the other.
TEST_P(Couette, HasTheProfileAndTheTorqueOfNewton) {
  const Turned turned = turn(GetParam(), 10, {});
  const double a2 = double{kInner_m * kInner_m}, b2 = double{kOuter_m * kOuter_m}, w = double{kSpin_rad_s};
  const double A = -w * a2 / (b2 - a2), B = w * a2 * b2 / (b2 - a2);
  const double expected_N_m = 4 * M_PI * 10 * B * double{kHeight_m};
  EXPECT_NEAR(turned.outer_N_m / expected_N_m, 1, 0.05);
  EXPECT_NEAR(turned.inner_N_m / expected_N_m, 1, 0.05);
  EXPECT_LT(differences(turned, [&](double r) { return A * r + B / r; }).worst, 0.05);
}

/// Of Carreau: mu(rate) rate = M / (2 pi r^2 h) gives the rate at every radius, and the turn between the two
/// cylinders is the integral of rate / r, by the midpoint rule of 2000 steps. M is found by bisection. Rates
/// fall about as r^(-2 / n), by half over a spacing at the inner cylinder, so it is the root mean square of
/// the speeds' differences that is within 5 % there.
TEST_P(Couette, HasTheProfileAndTheTorqueOfCarreau) {
  const Carreau law{.zero_shear_Pa_s = 20, .relaxation_s = 2, .index = 0.4F};
  const double last_Pa_s = 2, n = double{law.index}, lambda = double{law.relaxation_s};
  const auto stress_Pa = [&](double rate) {
    return rate * (last_Pa_s + (double{law.zero_shear_Pa_s} - last_Pa_s) *
                                   std::pow(1 + lambda * lambda * rate * rate, (n - 1) / 2));
  };
  const auto solve = [](auto&& rises, double value, double most) {
    double low = 0, high = most;
    for (int k = 0; k < 60; ++k) (rises(0.5 * (low + high)) < value ? low : high) = 0.5 * (low + high);
    return 0.5 * (low + high);
  };
  const double a = double{kInner_m}, b = double{kOuter_m}, h = double{kHeight_m};
  const auto turn_rad_s = [&](double torque_N_m, double from_m) {
    double sum = 0;
    const int steps = 2000;
    for (int k = 0; k < steps; ++k) {
      const double r = from_m + (k + 0.5) * (b - from_m) / steps;
      sum += solve(stress_Pa, torque_N_m / (2 * M_PI * r * r * h), 1e3) / r * (b - from_m) / steps;
    }
    return sum;
  };
  const double expected_N_m =
      solve([&](double torque) { return turn_rad_s(torque, a); }, double{kSpin_rad_s}, 1.0);
  const Turned turned = turn(GetParam(), static_cast<float>(last_Pa_s), law);
  EXPECT_NEAR(turned.outer_N_m / expected_N_m, 1, 0.05);
  EXPECT_NEAR(turned.inner_N_m / expected_N_m, 1, 0.05);
  std::vector<double> profile;  // [m/s] by fortieths of the gap
  for (int k = 0; k <= 40; ++k) {
    const double r = a + k * (b - a) / 40;
    profile.push_back(r * turn_rad_s(expected_N_m, r));
  }
  const Differences off = differences(turned, [&](double r) {
    const double at = std::min(std::max(0.0, (r - a) / (b - a)) * 40, 39.999);
    const auto k = static_cast<std::size_t>(at);
    return profile[k] + (at - std::floor(at)) * (profile[k + 1] - profile[k]);
  });
  EXPECT_LT(off.rms, 0.05) << "worst: " << off.worst;
}

/// Forces between particles are along the line between them, so a ball of very viscous liquid that spins in
/// empty space keeps its angular momentum to the rounding of floats: 1e-5 of it in some hundred steps. Half a
/// turn: friction that braked what turns would take 2 nu t / d of its outer layer's in that time, all of it.
TEST_P(Couette, WhatSpinsFreelyKeepsItsAngularMomentum) {
  DeviceSet set("cpu");
  const float d = kSpacing_m, spin_rad_s = 2;
  std::vector<LiquidParticle> particles;
  for (LiquidParticle p : fill_box({{-5 * d, -5 * d, -5 * d}, {5 * d, 5 * d, 5 * d}}, d)) {
    if (length(p.x_m) > 5 * d) continue;
    p.v_m_s = spin_rad_s * Vec3f{-p.x_m.y, p.x_m.x, 0};
    particles.push_back(p);
  }
  Liquid liquid(set, {.solver = GetParam(),
                      .spacing_m = d,
                      .density_kg_m3 = 1000,
                      .viscosity_Pa_s = 1,
                      .max_speed_m_s = 0.2F,
                      .box_m = {{-1, -1, -1}, {1, 1, 1}},
                      .max_particles = static_cast<Index>(particles.size())});
  liquid.place(particles);
  const auto angular = [](const std::vector<LiquidParticle>& all) {
    double sum = 0;
    for (const LiquidParticle& p : all) {
      const Vec3d x = vec_cast<double>(p.x_m), v = vec_cast<double>(p.v_m_s);
      sum += x.x * v.y - x.y * v.x;
    }
    return sum;
  };
  const double before = angular(particles);
  const float dt_s = liquid.largest_step_s();
  for (int k = 0; k < static_cast<int>(1.5F / dt_s); ++k) liquid.step({.dt_s = dt_s, .gravity_m_s2 = {}});
  EXPECT_NEAR(angular(liquid.particles()) / before, 1, 1e-5);
}

}  // namespace
}  // namespace tactus
