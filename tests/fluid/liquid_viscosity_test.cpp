#include <gtest/gtest.h>

#include <cmath>
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
  const NeighbourCells cells = liquid.search(0).cells();
  const NearWalls walls = liquid.near_walls(0);
  const float reach_m = liquid.constants().kernel.reach_m();
  for (Index i = 0; i < cells.placed[0]; ++i) {
    const Vec3f x = cells.particles[i].x_m, v = liquid.view().v_m_s[cells.order[i]];
    for (Index k = 0; k < walls.count[i]; ++k) walls.at(i, k).velocity_m_s = {v.x, v.y, 0};
    const float r = std::sqrt(x.x * x.x + x.y * x.y);
    const Vec3f out{x.x / r, x.y / r, 0}, along{-out.y, out.x, 0};
    if (r - kInner_m < reach_m)
      walls.add(i, {out, r - kInner_m, (kSpin_rad_s * kInner_m) * along, kInner, 0.F, {}});
    if (kOuter_m - r < reach_m) walls.add(i, {-1.F * out, kOuter_m - r, {}, kOuter, 0.F, {}});
  }
}

/// [N m] on a cylinder, about its axis.
double torque_N_m(Liquid& liquid, Index owner, float dt_s) {
  const NeighbourCells cells = liquid.search(0).cells();
  const NearWalls walls = liquid.near_walls(0);
  double sum = 0;
  for (Index i = 0; i < cells.placed[0]; ++i) {
    for (Index k = 0; k < walls.count[i]; ++k) {
      const NearWall& wall = walls.at(i, k);
      if (wall.owner != owner) continue;
      const Vec3f at = cells.particles[i].x_m - wall.distance_m * wall.n;
      sum += double{at.x * wall.impulse_N_s.y - at.y * wall.impulse_N_s.x};
    }
  }
  return sum / double{dt_s};
}

class Couette : public ::testing::TestWithParam<LiquidSolver> {};
INSTANTIATE_TEST_SUITE_P(Solvers, Couette, ::testing::Values(LiquidSolver::wcsph, LiquidSolver::dfsph));

/// Between a cylinder that turns and one that rests, v = A r + B / r and the torque is 4 pi mu B h: no
/// distance in it depends on a box. 5 %: the walls are half a spacing from the first layers, and what the
/// kernel's integral over a plane makes of a cylinder of 6 d is off by about d / (4 r). (The cylinder that
/// turns gets less: viscosity of differences of velocities is mu dv/dr there, and leaves out the mu v / r of
/// what spins.)
TEST_P(Couette, HasTheProfileAndTheTorqueOfNewton) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const std::vector<LiquidParticle> particles = ring();
  const float far = 1.2F * kOuter_m;
  Liquid liquid(set, {.solver = GetParam(),
                      .spacing_m = kSpacing_m,
                      .density_kg_m3 = 1000,
                      .viscosity_Pa_s = 10,
                      .max_speed_m_s = 0.2F,
                      .artificial_viscosity = 0,
                      .box_m = {{-far, -far, 0}, {far, far, kHeight_m}},
                      .max_particles = static_cast<Index>(particles.size()),
                      .other_walls = 2});
  liquid.place(particles);
  const StepTime time{.dt_s = liquid.largest_step_s(), .gravity_m_s2 = {}};
  double outer_N_m = 0;
  const int steps = static_cast<int>(0.6F / time.dt_s), last = 100;  // gap^2 / (pi^2 nu) = 0.1 s
  for (int i = 0; i < steps; ++i) {
    liquid.begin_step(time);
    ctx.synchronize();
    add_cylinders(liquid);
    liquid.end_step(time);
    ctx.synchronize();
    if (i < steps - last) continue;
    outer_N_m += torque_N_m(liquid, kOuter, time.dt_s) / last;
  }
  const double a2 = double{kInner_m * kInner_m}, b2 = double{kOuter_m * kOuter_m}, w = double{kSpin_rad_s};
  const double A = -w * a2 / (b2 - a2), B = w * a2 * b2 / (b2 - a2);
  const double expected_N_m = 4 * M_PI * 10 * B * double{kHeight_m};
  EXPECT_NEAR(outer_N_m / expected_N_m, 1, 0.05);
  double worst = 0;
  for (const LiquidParticle& p : liquid.particles()) {
    const Vec3d x = vec_cast<double>(p.x_m), v = vec_cast<double>(p.v_m_s);
    const double r = std::hypot(x.x, x.y), turns = (x.x * v.y - x.y * v.x) / r;
    worst = std::max(worst, std::abs(turns - (A * r + B / r)));
  }
  EXPECT_LT(worst, 0.05 * w * double{kInner_m});
}

}  // namespace
}  // namespace tactus
