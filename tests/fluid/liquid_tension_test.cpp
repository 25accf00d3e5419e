#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "tactus/fluid/liquid.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kSpacing_m = 0.001F, kDensity = 1000, kTension_N_m = 0.07F, kRadius_m = 10 * kSpacing_m;

class Drop : public ::testing::TestWithParam<LiquidSolver> {};
#define SKIP_WCSPH_UNLESS_LONG()                                                        \
  if (GetParam() == LiquidSolver::wcsph && std::getenv("TACTUS_LONG_TESTS") == nullptr) \
  GTEST_SKIP() << "the same forces as with dfsph, in three times as many steps: set TACTUS_LONG_TESTS=1"
INSTANTIATE_TEST_SUITE_P(Solvers, Drop, ::testing::Values(LiquidSolver::wcsph, LiquidSolver::dfsph));

LiquidSettings settings_of(LiquidSolver solver) {
  const float far = 4 * kRadius_m;
  return {.solver = solver,
          .spacing_m = kSpacing_m,
          .density_kg_m3 = kDensity,
          .viscosity_Pa_s = 0.001F,
          .surface_tension_N_m = kTension_N_m,
          .max_speed_m_s = 0.1F,
          .box_m = {{-far, -far, -far}, {far, far, far}},
          .max_particles = 6000};
}

/// Lattice points in a ball that is `stretch` times as long along z, and as much narrower as keeps its
/// volume.
std::vector<LiquidParticle> ball(float stretch) {
  std::vector<LiquidParticle> particles;
  const float r = kRadius_m, aside = 1 / std::sqrt(stretch);
  for (LiquidParticle p : fill_box({{-r, -r, -r}, {r, r, r}}, kSpacing_m)) {
    if (length(p.x_m) > r) continue;
    p.x_m = {aside * p.x_m.x, aside * p.x_m.y, stretch * p.x_m.z};
    particles.push_back(p);
  }
  return particles;
}

/// Of positions, 2 z^2 - x^2 - y^2.
double longer(const std::vector<LiquidParticle>& particles) {
  double sum = 0;
  for (const LiquidParticle& p : particles) {
    const Vec3d x = vec_cast<double>(p.x_m);
    sum += 2 * x.z * x.z - x.x * x.x - x.y * x.y;
  }
  return sum / static_cast<double>(particles.size()) / double{kRadius_m * kRadius_m};
}

double kinetic_J(const std::vector<LiquidParticle>& particles, double particle_kg) {
  double sum = 0;
  for (const LiquidParticle& p : particles) sum += 0.5 * particle_kg * double{dot(p.v_m_s, p.v_m_s)};
  return sum;
}

/// Mean pressure of what is deep in a drop, in the last step.
double pressure_Pa(const Liquid& liquid, float dt_s) {
  const std::vector<float> p_Pa = liquid.pressures_Pa(dt_s);
  const std::vector<LiquidParticle> particles = liquid.particles();
  double sum = 0, inside = 0;
  for (std::size_t i = 0; i < p_Pa.size(); ++i) {
    if (length(particles[i].x_m) > 0.6F * kRadius_m) continue;
    sum += double{p_Pa[i]};
    ++inside;
  }
  return sum / inside;
}

/// A drop of radius 10 d that was 10 % too long swings with Lamb's period 2 pi (rho R^3 / (8 sigma))^(1/2),
/// and the pressure in it is Laplace's 2 sigma / R. 10 %: curvatures are corrected to the first order in d /
/// R = 0.1, of which the square is 1 %; normals of particles that have left the lattice differ by some 0.1 in
/// the 26 neighbours that a curvature is found from, which leaves some percent. The drop neither freezes nor
/// boils: it turns round three times, and moves less in the second period.
TEST_P(Drop, SwingsAsLambSaysWithThePressureOfLaplace) {
  SKIP_WCSPH_UNLESS_LONG();
  DeviceSet set("cpu");
  Liquid liquid(set, settings_of(GetParam()));
  std::vector<LiquidParticle> particles = ball(1.1F);
  liquid.place(particles);
  const double R = std::cbrt(3 * static_cast<double>(particles.size()) / (4 * M_PI)) * double{kSpacing_m};
  const double sigma = double{kTension_N_m};
  const double period_s = 2 * M_PI * std::sqrt(double{kDensity} * R * R * R / (8 * sigma));
  const float dt_s = liquid.largest_step_s();
  const int steps = static_cast<int>(1.5 * period_s / double{dt_s}), every = std::max(1, steps / 320);
  std::vector<double> crossings, samples_Pa;
  double last = 1, most_J[2] = {};
  for (int k = 0; k < steps; ++k) {
    liquid.step({.dt_s = dt_s, .gravity_m_s2 = {}});
    if (k % every != 0) continue;
    particles = liquid.particles();
    const double t = k / (2.0 / 3 * steps), now = longer(particles);  // in periods
    if (now * last < 0) crossings.push_back(k * double{dt_s});
    last = now;
    double& most = most_J[t < 1 ? 0 : 1];
    most = std::max(most, kinetic_J(particles, double{liquid.constants().mass_kg}));
    if (t > 1) samples_Pa.push_back(pressure_Pa(liquid, dt_s));
  }
  ASSERT_EQ(crossings.size(), 3U) << "a frozen drop doesn't turn round";
  EXPECT_NEAR((crossings[2] - crossings[0]) / period_s, 1, 0.1);
  EXPECT_LT(most_J[1], most_J[0]);
  double pressure = 0;
  for (const double p : samples_Pa) pressure += p / static_cast<double>(samples_Pa.size());
  EXPECT_NEAR(pressure / (2 * sigma / R), 1, 0.1);
}

/// The corners of a cube run to its middle. There they must not stay pressed together: iterations of the
/// pressure that overshoot did that, for ever, at four times the density. Care begins at 1.03 (kSqueezed), so
/// what rests is below 1.02; while the cube implodes, a step mends an error of a tenth (most_mended).
TEST(Cube, DoesNotStayPressedTogether) {
  for (const float max_speed_m_s : {0.1F, 1.F}) {
    DeviceSet set("cpu");
    LiquidSettings settings = settings_of(LiquidSolver::dfsph);
    settings.max_speed_m_s = max_speed_m_s;
    Liquid liquid(set, settings);
    constexpr float kHalf_m = 6 * kSpacing_m;
    liquid.place(fill_box({{-kHalf_m, -kHalf_m, -kHalf_m}, {kHalf_m, kHalf_m, kHalf_m}}, kSpacing_m));
    const float dt_s = liquid.largest_step_s();
    float densest = 0;
    for (int k = 0; k < 400; ++k) {
      liquid.step({.dt_s = dt_s, .gravity_m_s2 = {}});
      if (k % 20 != 19) continue;
      liquid.end_frame();
      const float now = to_host(set.context(0), liquid.report_view())[0].densest;
      EXPECT_LT(now, 1.1F) << "step " << k << ", " << max_speed_m_s << " m/s";
      if (k >= 200) densest = std::max(densest, now);
    }
    EXPECT_LT(densest, 1.02F) << max_speed_m_s << " m/s";
  }
}

/// How high the middle of a spherical cap is that meets the floor at this angle.
double middle_of_cap_m(double volume_m3, double angle) {
  const double c = std::cos(angle), R = std::cbrt(3 * volume_m3 / (M_PI * (2 + c) * (1 - c) * (1 - c))),
               h = R * (1 - c);
  return 3 * (2 * R - h) * (2 * R - h) / (4 * (3 * R - h)) - R * c;
}

/// Half a ball on a floor becomes the cap that has the contact angle, +-10 degrees; its middle rises with it.
/// Without gravity, from a quarter of a second on, when viscosity has calmed it. The floor bears the
/// pressure, and is pulled as much by the line where the surface ends, sigma sin(angle) 2 pi a. To 0.4 of
/// that: 0.30 and -0.12 came, for the line's length is made of the surface in the two layers beside the wall,
/// which at 60 degrees are a wedge of one to three particles.
TEST_P(Drop, MeetsAWallAtItsAngle) {
  SKIP_WCSPH_UNLESS_LONG();
  for (const float angle_deg : {60.F, 120.F}) {
    DeviceSet set("cpu");
    LiquidSettings settings = settings_of(GetParam());
    settings.box_m.min.y = 0;
    settings.contact_angle_deg = angle_deg;
    settings.viscosity_Pa_s = 0.02F;
    Liquid liquid(set, settings);
    std::vector<LiquidParticle> particles;
    const float r = 7 * kSpacing_m;
    for (const LiquidParticle& p : fill_box({{-r, 0, -r}, {r, r, r}}, kSpacing_m))
      if (length(p.x_m) < r) particles.push_back(p);
    liquid.place(particles);
    const float dt_s = liquid.largest_step_s();
    const int steps = static_cast<int>(0.5F / dt_s), from = steps / 2, every = 20;
    double middle_m = 0, samples = 0;
    for (int k = 0; k < steps; ++k) {
      liquid.step({.dt_s = dt_s, .gravity_m_s2 = {}});
      if (k == from - 1) liquid.end_frame();
      if (k < from || k % every != 0) continue;
      particles = liquid.particles();
      for (const LiquidParticle& p : particles)
        middle_m += double{p.x_m.y} / static_cast<double>(particles.size());
      ++samples;
    }
    const double volume_m3 = static_cast<double>(particles.size()) * std::pow(double{kSpacing_m}, 3);
    double low = 0.1, high = 3.1;
    for (int k = 0; k < 50; ++k) {
      const double mid = 0.5 * (low + high);
      (middle_of_cap_m(volume_m3, mid) < middle_m / samples ? low : high) = mid;
    }
    EXPECT_NEAR(low * 180 / M_PI, double{angle_deg}, 10);
    liquid.end_frame();
    double force_N = 0;
    for (const Vec3f wall : to_host(set.context(0), liquid.wall_impulses_N_s()))
      force_N += double{wall.y} / (double{dt_s} * (steps - from));
    const double angle = double{angle_deg} * M_PI / 180, c = std::cos(angle),
                 R = std::cbrt(3 * volume_m3 / (M_PI * (2 + c) * (1 - c) * (1 - c))),
                 pull_N = double{kTension_N_m} * std::sin(angle) * 2 * M_PI * R * std::sin(angle);
    std::printf("%.0f degrees: on the floor %.2f of the line's pull\n", double{angle_deg}, force_N / pull_N);
    EXPECT_NEAR(force_N / pull_N, 0, 0.4);
  }
}

/// 0.95 ml of thick blood at 40 degrees on a floor. Without the pull of the line where its surface ends, the
/// floor bears 1.4 times the weight. To 0.25: the pull is 0.4 of the weight here, and known to 0.4, and a
/// puddle still spreads.
TEST(Puddle, WeighsWhatItWeighs) {
  DeviceSet set("cpu");
  LiquidSettings settings = settings_of(LiquidSolver::dfsph);
  settings.viscosity_Pa_s = 0.05F;
  settings.surface_tension_N_m = 0.056F;
  settings.contact_angle_deg = 40;
  settings.max_speed_m_s = 0.5F;
  settings.box_m.min.y = 0;
  Liquid liquid(set, settings);
  const float r = 9 * kSpacing_m;
  liquid.place(fill_box({{-r, 0, -r}, {r, 3 * kSpacing_m, r}}, kSpacing_m));
  const Vec3f gravity{0, -9.81F, 0};
  const float dt_s = liquid.largest_step_s(), weight_N = 972 * liquid.constants().mass_kg * gravity.y;
  const auto run = [&](float seconds) {
    const int steps = static_cast<int>(seconds / dt_s);
    for (int k = 0; k < steps; ++k) liquid.step({.dt_s = dt_s, .gravity_m_s2 = gravity});
    liquid.end_frame();
    float force_N = 0;
    for (const Vec3f wall : to_host(set.context(0), liquid.wall_impulses_N_s()))
      force_N += wall.y / (static_cast<float>(steps) * dt_s);
    return force_N;
  };
  run(0.5F);
  const float share = run(0.5F) / weight_N;
  std::printf("a puddle's force on the floor over its weight: %.2f\n", double{share});
  EXPECT_NEAR(share, 1, 0.25);
}

}  // namespace
}  // namespace tactus
