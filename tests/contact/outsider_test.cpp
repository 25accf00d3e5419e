/// What was found wrong by those who checked contact from outside, each with its bar.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "contact/soft_scene.h"
#include "support/device_sets.h"

namespace tactus {
namespace {

/// Force on a rigid ball pressed by `depth_m` into a layer that is bonded to a rigid base (Dimitriadis et al.
/// 2002, Biophys. J. 82: 2798): Hertz's force times a series in sqrt(R d) / thickness.
double layer_force_N(double young_Pa, double poisson, double radius_m, double depth_m, double thickness_m) {
  const double a0 = -(1.2876 - 1.4678 * poisson + 1.3442 * poisson * poisson) / (1 - poisson);
  const double b0 = (0.6387 - 1.0277 * poisson + 1.5164 * poisson * poisson) / (1 - poisson);
  const double pi = 3.14159265358979, x = std::sqrt(radius_m * depth_m) / thickness_m;
  const double series = 1 - 2 * a0 / pi * x + 4 * a0 * a0 / (pi * pi) * x * x -
                        8 / (pi * pi * pi) * (a0 * a0 * a0 + 4 * pi * pi / 15 * b0) * x * x * x +
                        16 * a0 / (pi * pi * pi * pi) * (a0 * a0 * a0 + 3 * pi * pi / 5 * b0) * x * x * x * x;
  return 4.0 / 3 * young_Pa / (1 - poisson * poisson) * std::sqrt(radius_m) * std::pow(depth_m, 1.5) * series;
}

double pressed_ball_N(float h, float points_per_spacing) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float radius = 0.05F, depth = 0.002F;
  const Vec3i cubes{static_cast<Index>(std::lround(0.12F / h)), static_cast<Index>(std::lround(0.06F / h)),
                    static_cast<Index>(std::lround(0.12F / h))};
  const float half = 0.5F * h * static_cast<float>(cubes.x), top = h * static_cast<float>(cubes.y);
  test::SoftThing block =
      test::soft_box(ctx, {-half, 0, -half}, cubes, h, {.points_per_spacing = points_per_spacing},
                     [](Vec3f p) { return p.y < 1e-5F; });
  test::SoftScene scene(ctx, block, h, {.friction = 0});
  scene.show(
      test::transformed(test::unit_sphere(32), {Mat3f::identity(), {0, top + radius - depth, 0}}, radius));
  const float dt = 0.9F * block.solver.stable_step_s();
  for (int f = 0; f < 20; ++f) scene.run(static_cast<int>(0.05F / dt), dt, {}, 30);
  const ContactReport report = scene.run(10, dt, {}, 30);
  return static_cast<double>(report.force_N.y);
}

TEST(Outsider, HertzTry) {
  for (const float points : {2.F}) {
    for (const float h : {0.01F, 0.006F}) {
      const double want =
          layer_force_N(10000, 0.45, 0.05, 0.002, static_cast<double>(h) * std::lround(0.06F / h));
      const double got = pressed_ball_N(h, points);
      std::printf("points %g h %g: %.4f N of %.4f: %+.1f %%\n", points, h, got, want, 100 * (got / want - 1));
      std::fflush(stdout);
    }
  }
}

}  // namespace
}  // namespace tactus
