// Viscoelastic elements (Prony series) against their closed form.
#include <gtest/gtest.h>

#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/tissue/tled/material_laws.h"
#include "tissue/tled_bodies.h"

namespace tactus {
namespace {

using test::message_of;

const TledOptions kRelaxing{.damping_ratio = 0, .relaxation = {{{0.4F, 0.05F}, {0.2F, 0.5F}}}};

/// What is left of the shear modulus at a time after a step of strain.
double remaining(const TledOptions& options, double time_s) {
  double left = 1;
  for (const RelaxationTerm& term : options.relaxation)
    left += static_cast<double>(term.share) *
            (std::exp(-time_s / static_cast<double>(term.time_s)) - (term.is_added ? 0 : 1));
  return left;
}

/// Forces of cubes that are held strained: those of mu fade as G(t), those of lambda stay. Float rounding of
/// the forces' terms is 1e-6 of them; a history that grows by 1e-3 of itself a step is rounded to 1e-4 at
/// most.
void expect_closed_form(const TledOptions& options, const Mat3f& F, float dt_s) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({9, 2, 2});
  const ElasticMaterial m{.young_Pa = 3000, .poisson = 0.4F};
  TledOptions elastic = options;
  elastic.relaxation = {};
  Tled at_once(ctx, lattice, {&m, 1}, {}, elastic), relaxing(ctx, lattice, {&m, 1}, {}, options);
  const std::vector<Vec3f> x = moved(lattice, F), first = forces(ctx, at_once, lattice, x);
  const GradientColumns P = with_law(options, [&](const auto& law) {
    return law.stress({F.column(0), F.column(1), F.column(2)}, 0.F, m.lambda_Pa());
  });
  // On the corner at the origin: h^2 / 4 times the sum of the columns of P.
  const Vec3f lasting = 0.25F * kH * kH * (P.x + P.y + P.z);
  BodyState state = rest_state(ctx, lattice);
  state.x_m = to_device(ctx, x);
  double time_s = 0;
  for (int k = 1; k <= 2000 && time_s < 1.5; ++k) {
    relaxing.compute_forces(ctx, state, {.dt_s = dt_s, .gravity_m_s2 = {}});
    time_s = k * static_cast<double>(dt_s);
    if (k % 97 != 1) continue;
    const Vec3f now = relaxing.forces_N(ctx)[0];
    for (int a = 0; a < 3; ++a) {
      const double expected = static_cast<double>(lasting[a]) +
                              remaining(options, time_s) * static_cast<double>(first[0][a] - lasting[a]);
      ASSERT_NEAR(static_cast<double>(now[a]), expected, 5e-4 * static_cast<double>(length(first[0])))
          << time_s << " s, axis " << a;
    }
  }
}

TEST(Relaxation, StepStrainFollowsTheClosedForm) {
  for (const MaterialLaw law : kEveryLaw) {
    TledOptions options = kRelaxing;
    options.law = law;
    options.fibre = {1, 1, 0};
    options.fibre_ratio = 2;
    SCOPED_TRACE(static_cast<int>(law));
    expect_closed_form(options, {{{1, 0.3F, 0}, {0, 1, 0}, {0, 0, 1}}}, 0.001F);         // shear
    expect_closed_form(options, {{{1.2F, 0, 0}, {0, 0.95F, 0}, {0, 0, 0.9F}}}, 0.001F);  // stretch
  }
}

/// The step that a frame is cut into changes nothing: exponentials are exact for a held strain.
TEST(Relaxation, AnyStepGivesTheSameStress) {
  for (const float dt_s : {0.0001F, 0.003F, 0.02F, 0.5F})
    expect_closed_form(kRelaxing, {{{1, 0.3F, 0}, {0, 1, 0}, {0, 0, 1}}}, dt_s);
}

/// A term that is added begins above mu, and mu is what lasts; one alone is stored by itself.
TEST(Relaxation, AddedTermsComeOnTop) {
  const RelaxationTerm added{.share = 0.8F, .time_s = 0.05F, .is_added = true}, fading{0.2F, 0.5F};
  for (const TledOptions& options : {TledOptions{.damping_ratio = 0, .relaxation = {{added}}},
                                     TledOptions{.damping_ratio = 0, .relaxation = {{added, fading}}}})
    expect_closed_form(options, {{{1.1F, 0.3F, 0}, {0, 0.95F, 0}, {0, 0, 1}}}, 0.001F);
}

/// At the step that it reports, a shaken free body only loses energy: 0.05 s are some hundred steps of the
/// softest, and what is added fades meanwhile. With nu = 0 most of the stiffness is that of shear.
TEST(Relaxation, ReportedStepsAreStableWithAddedTerms) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({3, 3, 3});
  for (const float poisson : {0.F, 0.45F}) {
    const ElasticMaterial m{.young_Pa = 3000, .poisson = poisson};
    Tled tled(ctx, lattice, {&m, 1}, {},
              {.damping_ratio = 0, .relaxation = {{{.share = 0.8F, .time_s = 0.05F, .is_added = true}}}});
    BodyState body = rest_state(ctx, lattice);
    body.x_m = to_device(ctx, shaken(lattice, 0.01F * kH, 9));
    double most_J = 0;
    for (int k = 0; k < 10; ++k) {
      tled.step(ctx, body, {tled.stable_step_s(), {}}, 20);
      most_J = std::max(most_J, kinetic_J(ctx, lattice, body));
    }
    tled.step(ctx, body, {tled.stable_step_s(), {}}, 4000);
    EXPECT_LT(kinetic_J(ctx, lattice, body), 0.1 * most_J) << poisson;
  }
}

/// The history turns with the body: a strained body that is turned by 90 degrees pulls the same, turned.
TEST(Relaxation, HistoryTurnsWithTheBody) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({2, 2, 2});
  const ElasticMaterial m{};
  Tled tled(ctx, lattice, {&m, 1}, {}, kRelaxing);
  BodyState state = rest_state(ctx, lattice);
  const Mat3f F{{{1.1F, 0.3F, 0}, {0, 0.9F, 0.1F}, {0, 0, 1}}}, R{{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}};
  state.x_m = to_device(ctx, moved(lattice, F));
  tled.compute_forces(ctx, state, {.dt_s = 0.2F, .gravity_m_s2 = {}});
  tled.compute_forces(ctx, state);
  const std::vector<Vec3f> before = tled.forces_N(ctx);
  state.x_m = to_device(ctx, moved(lattice, R * F));
  tled.compute_forces(ctx, state);
  const std::vector<Vec3f> after = tled.forces_N(ctx);
  for (std::size_t i = 0; i < after.size(); ++i)
    EXPECT_LT(length(after[i] - R * before[i]), 1e-5F * m.lambda_Pa() * kH * kH) << i;
}

/// A clamped beam first bends as its material at once, and in the end as the relaxed one: as an elastic beam
/// of mu (1 - shares) and the same lambda does. Hourglass control is that of the relaxed material, too: 1 %.
TEST(Relaxation, BeamCreepsToThatOfTheRelaxedMaterial) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  CubeLattice lattice = box({20, 4, 4});
  lattice.fix_half_space({0.01F * kH, 0, 0}, {1, 0, 0});
  const ElasticMaterial m{.young_Pa = 60000, .poisson = 0.45F};
  const float mu = 0.4F * m.mu_Pa(), lambda = m.lambda_Pa();
  const ElasticMaterial soft{.young_Pa = mu * (3 * lambda + 2 * mu) / (lambda + mu),
                             .poisson = lambda / (2 * (lambda + mu))};
  const auto tip = [&](const ElasticMaterial& material, const TledOptions& options) {
    Tled tled(ctx, lattice, {&material, 1}, {}, options);
    BodyState body = rest_state(ctx, lattice);
    const float dt = tled.stable_step_s();
    tled.step(ctx, body, {dt, {0, 0, -9.81F}, 20}, static_cast<int>(4.5F / dt));
    return to_host(ctx, body.x_m.const_view()).back().z - lattice.rest_m(lattice.node_count() - 1).z;
  };
  const float crept = tip(m, kRelaxing), relaxed = tip(soft, {}), at_once = tip(m, {});
  std::printf("tip: at once %.4f, crept %.4f, relaxed material %.4f m\n", static_cast<double>(at_once),
              static_cast<double>(crept), static_cast<double>(relaxed));
  EXPECT_NEAR(crept / relaxed, 1, 0.01);
  EXPECT_LT(std::abs(at_once), 0.8F * std::abs(crept));
}

class RelaxationDevices : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(RelaxationDevices);

/// The same bits on any devices, in one call of many substeps or in odd pieces.
TEST_P(RelaxationDevices, SameBitsAsOneCpu) {
  CubeLattice lattice = ball(0.041F);
  lattice.fix_half_space({0, 0, -0.035F}, {0, 0, 1});
  const ElasticMaterial m{};
  const std::vector<Vec3f> x = shaken(lattice, 0.1F * kH, 9), v(x.size());
  for (const bool both : {false, true}) {
    ElementMask elements;
    if (both) elements = split_by_ratio(lattice, 0, 6, 4);
    const auto run = [&](const std::string& devices, std::initializer_list<int> pieces) {
      DeviceSet set(devices, 7);
      BodySolver body(set,
                      {.lattice = lattice,
                       .elements = elements,
                       .materials = {&m, 1},
                       .tled = kRelaxing,
                       .flsm = {.young_Pa = 3000}},
                      {.least_elements = 0});
      body.set_state(x, v);
      for (const int count : pieces) body.step({.dt_s = body.stable_step_s()}, count);
      return body.positions_m();
    };
    const std::vector<Vec3f> expected = run("cpu", {50});
    EXPECT_EQ(run(GetParam(), {50}), expected) << both;
    EXPECT_EQ(run(GetParam(), {1, 3, 1, 20, 25}), expected) << both;
  }
}

TEST(Relaxation, BadTermsAreNamed) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = box({2, 2, 2});
  const ElasticMaterial m{};
  const auto message = [&](const TledOptions& options) {
    return message_of([&] { Tled(ctx, lattice, {&m, 1}, {}, options); });
  };
  EXPECT_EQ(message({.relaxation = {{{0.6F, 1}, {0.5F, 1}}}}),
            "sum of relaxation shares is 1.1, expected less than 1");
  EXPECT_EQ(message({.relaxation = {{{-0.1F, 1}}}}), "relaxation share is -0.1, expected 0 or more");
  EXPECT_EQ(message({.relaxation = {{{0.1F, 0}}}}), "relaxation time [s] is 0, expected a positive number");
  EXPECT_EQ(message({.relaxation = {{{NAN, 1}}}}), "relaxation share is nan, expected 0 or more");
  EXPECT_EQ(message({.full_integration = true, .relaxation = {{{0.1F, 1}}}}),
            "stresses that relax need one integration point, not full integration");
}

}  // namespace
}  // namespace tactus
