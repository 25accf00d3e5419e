#include <gtest/gtest.h>

#include "tactus/tissue/body_monitors.h"
#include "tissue/tled_bodies.h"

namespace tactus {
namespace {

/// A free body that rings without damping: kinetic, elastic and hourglass energy go back and forth, their sum
/// stays. The scheme's velocities are half a step from its positions, so the sum wobbles by omega dt / 2: 10
/// % at a tenth of the stable step for the fastest mode.
TEST(Tled, MonitorsSeeEnergyConserved) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({6, 4, 3});
  const ElasticMaterial m{};
  const TledOptions options{.damping_ratio = 0};
  Tled tled(ctx, lattice, {&m, 1}, {}, options);
  BodyState body = rest_state(ctx, lattice);
  body.x_m = to_device(ctx, shaken(lattice, 0.05F * kH, 3));
  const auto measure = [&] {
    return measure_body(lattice, {}, {&m, 1}, {}, options, to_host(ctx, body.x_m.const_view()),
                        to_host(ctx, body.v_m_s.const_view()));
  };
  const BodyMonitors before = measure();
  EXPECT_EQ(before.kinetic_J, 0);
  EXPECT_GT(before.hourglass_J, 0);
  const double total = before.elastic_J + before.hourglass_J;
  double most_kinetic = 0;
  for (int k = 0; k < 400; ++k) {
    tled.step(ctx, body, {0.1F * tled.stable_step_s(), {}});
    const BodyMonitors now = measure();
    most_kinetic = std::max(most_kinetic, now.kinetic_J);
    ASSERT_NEAR((now.kinetic_J + now.elastic_J + now.hourglass_J) / total, 1, 0.1) << k;
    ASSERT_NEAR(now.volume_m3 / (72 * std::pow(static_cast<double>(kH), 3)), 1, 0.1);
  }
  EXPECT_GT(most_kinetic, 0.3 * total);
  EXPECT_LT(length(measure().momentum_kg_m_s), 1e-6 * std::sqrt(2 * lattice.mass_kg() * total));
}

/// First bending frequency of a slender clamped beam (L/t = 10) for small motion, Euler-Bernoulli:
/// f = 0.1615 t/L^2 sqrt(E/rho). Shear and rotary inertia lower it by about 1 %, four cubes across raise or
/// lower it by about 1 %.
TEST(Tled, CantileverSwingsAtItsFrequency) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  CubeLattice lattice = box({40, 4, 4});
  lattice.fix_half_space({0.01F * kH, 0, 0}, {1, 0, 0});
  const ElasticMaterial m{.young_Pa = 30000, .poisson = 0.3F};
  Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
  BodyState body = rest_state(ctx, lattice);
  std::vector<Vec3f> v(lattice.nodes.size());
  for (std::size_t i = 0; i < v.size(); ++i)
    v[i].z = 0.003F * sqr(static_cast<float>(lattice.nodes[i].x) / 40);
  body.v_m_s = to_device(ctx, v);
  const float dt = tled.stable_step_s();
  const auto last = at(lattice.node_count() - 1);
  const float rest_z = lattice.rest_m(lattice.node_count() - 1).z;
  std::vector<double> rises;
  float before = 0;
  for (int k = 0; rises.size() < 5 && k < 100000; ++k) {
    tled.step(ctx, body, {dt, {}});
    const float z = to_host(ctx, body.x_m.const_view())[last].z - rest_z;
    if (before < 0 && z >= 0)
      rises.push_back(static_cast<double>(dt) * (k + static_cast<double>(z / (before - z))));
    before = z;
  }
  ASSERT_EQ(rises.size(), 5U);
  const double frequency = 4 / (rises[4] - rises[0]);
  const double expected = 0.1615 * 0.02 / (0.2 * 0.2) * std::sqrt(30000.0 / 1000);
  EXPECT_NEAR(frequency / expected, 1, 0.03);
}

/// Shaken bodies without damping stay bounded at the step that is reported, whatever their shape: at a part r
/// of its critical step the scheme keeps v^2/2 (1 - r^2) + ..., so a mode's kinetic energy stays below 1 / (1
/// - r^2) = 10 times what was put in (r = 0.95), while instability multiplies it at every step. At 1.2 of the
/// critical step they blow up.
TEST(Tled, ReportedStepIsStableAndNotTimid) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  for (const float poisson : {0.3F, 0.45F, 0.49F}) {
    const ElasticMaterial m{.young_Pa = 3000, .poisson = poisson};
    for (const CubeLattice& lattice :
         {box({1, 1, 1}), corner_chain(), box({1, 1, 12}), box({20, 4, 4}), box({6, 6, 6})}) {
      const auto grows = [&](float dt_s, Tled& tled) {
        BodyState body = rest_state(ctx, lattice);
        const std::vector<Vec3f> x = shaken(lattice, 1e-3F * kH, 2);
        std::vector<Vec3f> v(x.size());
        for (std::size_t i = 0; i < x.size(); ++i)
          v[i] = 100.F * (x[i] - lattice.rest_m(static_cast<Index>(i)));
        body.v_m_s = to_device(ctx, v);
        const double energy = kinetic_J(ctx, lattice, body);
        for (int k = 0; k < 3000; ++k) tled.step(ctx, body, {dt_s, {}});
        return !(kinetic_J(ctx, lattice, body) < 12 * energy);
      };
      Tled guaranteed(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
      EXPECT_FALSE(grows(0.95F * guaranteed.stable_step_s(), guaranteed)) << lattice.cube_count();
      Tled measured(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
      const float step = measured.measure_stable_step(ctx, lattice);
      EXPECT_GE(step, 0.95F * 0.95F * guaranteed.stable_step_s()) << lattice.cube_count();
      EXPECT_FALSE(grows(step, measured)) << lattice.cube_count() << " cubes, nu " << poisson;
      // The same forces on masses so light that this step is 1.2 / 0.95 of theirs.
      CubeLattice light = lattice;
      for (float& mass : light.node_mass_kg) mass /= sqr(1.2F / 0.95F);
      Tled beyond(ctx, light, {&m, 1}, {}, {.damping_ratio = 0});
      EXPECT_FLOAT_EQ(beyond.measure_stable_step(ctx, lattice), step);
      EXPECT_TRUE(grows(step, beyond)) << lattice.cube_count() << " cubes, nu " << poisson;
    }
  }
}

/// Ten seconds, undamped, at 0.95 of the step that is reported: energy stays below what the scheme may make
/// of it (12, see above), for the proven step and for the measured one.
TEST(Tled, ReportedStepsAreStableForTenSeconds) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const ElasticMaterial m{.young_Pa = 3000, .poisson = 0.45F};
  CubeLattice cantilever = box({20, 4, 4});
  cantilever.fix_half_space({0.01F * kH, 0, 0}, {1, 0, 0});
  for (const CubeLattice& lattice : {cantilever, box({1, 1, 1}), corner_chain(), box({1, 1, 12})}) {
    for (const bool measured : {false, true}) {
      Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
      if (measured) tled.measure_stable_step(ctx, lattice);
      const float dt = 0.95F * tled.stable_step_s();
      BodyState body = rest_state(ctx, lattice);
      const std::vector<Vec3f> x = shaken(lattice, 1e-3F * kH, 2);
      std::vector<Vec3f> v(x.size());
      for (std::size_t i = 0; i < x.size(); ++i)
        if (lattice.fixed[i] == 0) v[i] = 100.F * (x[i] - lattice.rest_m(static_cast<Index>(i)));
      body.v_m_s = to_device(ctx, v);
      const double energy = kinetic_J(ctx, lattice, body);
      double most = 0;
      for (int part = 0; part < 10; ++part) {
        tled.step(ctx, body, {dt, {}}, static_cast<int>(1 / dt) + 1);
        most = std::max(most, kinetic_J(ctx, lattice, body));
      }
      EXPECT_LT(most, 12 * energy) << lattice.cube_count() << " cubes, measured " << measured;
      EXPECT_GT(most, 0.01 * energy);
    }
  }
}

/// Strain makes waves faster: a cube held at 1.5 along two axes is stable with the substeps that the monitor
/// asks for, for 10 s.
TEST(Tled, MonitorSplitsTheStepsOfAStretchedCube) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  CubeLattice lattice = box({3, 3, 3});
  std::fill(lattice.fixed.begin(), lattice.fixed.end(), kAllAxes);
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3i n = lattice.nodes[at(i)];
    if (n.x % 3 != 0 && n.y % 3 != 0 && n.z % 3 != 0) lattice.fixed[at(i)] = 0;
  }
  const ElasticMaterial m{.young_Pa = 3000, .poisson = 0.45F};
  Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0});
  BodyState body = rest_state(ctx, lattice);
  body.x_m = to_device(ctx, moved(lattice, {{{1.5F, 0, 0}, {0, 1.5F, 0}, {0, 0, 1}}}));
  tled.compute_forces(ctx, body);
  tled.find_extremes(ctx, body);
  const tled::CubeExtremes e = tled.extremes(ctx);
  EXPECT_NEAR(e.smallest_J, 2.25F, 1e-4F);
  EXPECT_EQ(e.inverted, 0);
  // cof F = diag(1.5, 1.5, 2.25): (lambda + mu/J^2) 5.06 + mu over lambda + 2 mu.
  const float lambda = m.lambda_Pa(), mu = m.mu_Pa();
  EXPECT_NEAR(e.speed_ratio, std::sqrt(((lambda + mu / 5.0625F) * 5.0625F + mu) / (lambda + 2 * mu)), 1e-3F);
  const int substeps = tled.substeps_for(0.01F, e.speed_ratio);
  std::vector<Vec3f> v(lattice.nodes.size(), Vec3f{0.001F, -0.002F, 0.001F});
  body.v_m_s = to_device(ctx, v);
  tled.step(ctx, body, {0.01F / static_cast<float>(substeps), {}}, 1000 * substeps);
  EXPECT_LT(kinetic_J(ctx, lattice, body), 1e-7);
}

/// Inner forces come in pairs: momentum changes by rounding only. Damping damps no fall.
TEST(Tled, FreeFlightKeepsMomentumAndFalls) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = ball(0.021F);
  const ElasticMaterial m{};
  const auto fly = [&](Vec3f gravity, float damping, Vec3f v0, float time_s) {
    Tled tled(ctx, lattice, {&m, 1}, {}, {.damping_ratio = damping});
    BodyState body = rest_state(ctx, lattice);
    std::vector<Vec3f> v(lattice.nodes.size(), v0);
    if (damping == 0) v[3].x += 0.2F;  // it also rings
    body.v_m_s = to_device(ctx, v);
    const int steps = tled.substeps_for(time_s);
    for (int k = 0; k < steps; ++k) tled.step(ctx, body, {time_s / static_cast<float>(steps), gravity});
    Vec3d momentum{}, center{};
    double mass = 0;
    const auto vel = to_host(ctx, body.v_m_s.const_view()), x = to_host(ctx, body.x_m.const_view());
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double mi = static_cast<double>(lattice.node_mass_kg[i]);
      momentum += mi * (vec_cast<double>(vel[i]) - vec_cast<double>(v[i]));
      center += mi * (vec_cast<double>(x[i]) - vec_cast<double>(lattice.rest_m(static_cast<Index>(i))));
      mass += mi;
    }
    return std::pair{(1 / mass) * momentum, (1 / mass) * center};
  };
  const auto [drift, way] = fly({}, 0, {0.5F, 0, 0}, 1);
  EXPECT_LT(length(drift), 1e-5 * 0.7);
  EXPECT_NEAR(way.x, 0.5, 1e-3);
  const auto [speed, fall] = fly({0, -9.81F, 0}, 0.3F, {}, 0.5F);
  EXPECT_NEAR(speed.y, -9.81 * 0.5, 1e-4 * 9.81 * 0.5);
  // g t^2 / 2 and, velocity first, then position, g t dt / 2 (0.6 mm) from the scheme's half step.
  Tled damped(ctx, lattice, {&m, 1}, {}, {.damping_ratio = 0.3F});
  const double dt = 0.5 / damped.substeps_for(0.5F), half = 0.5 * 9.81 * 0.5;
  EXPECT_NEAR(fall.y, -half * (0.5 + dt), 1e-4 * half * 0.5);
}

}  // namespace
}  // namespace tactus
