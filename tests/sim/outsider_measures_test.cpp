// What users of biomechanics ask for: strain and stress, torques, drag.
#include <gtest/gtest.h>

#include <cmath>

#include "support/filmed_world.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/body/body_shape.h"

namespace tactus {
namespace {

Scene free_block() {
  Scene scene;
  scene.reconstruction.resolution = 16;
  BodyDescription block;
  block.material.half_width = 2;
  block.name = "block";
  block.shape.size_m = {0.1, 0.06, 0.08};
  block.spacing_m = 0.02;
  block.material.model = TissueModel::tled;
  block.contact = false;
  scene.bodies = {block};
  scene.gravity_m_s2 = {};
  return scene;
}

/// Stretched by s along x and held across: W = mu/2 (s^2 - 1) - mu ln s + lambda/2 (s - 1)^2, so Cauchy's
/// stress is mu (s - 1/s) + lambda (s - 1) along x and lambda (s - 1) across. Floats of positions: 1e-6.
TEST(OutsiderMeasures, StrainAndStressAreThoseOfTheClosedForm) {
  const CubeLattice lattice = lattice_from_box({0, 0, 0}, {2, 1, 1}, {.spacing_m = 0.01F});
  const float s = 1.25F;
  std::vector<Vec3f> x = lattice.rest_positions_m();
  for (Vec3f& p : x) p.x *= s;
  const ElasticMaterial m{.young_Pa = 5000, .poisson = 0.4F};
  const double mu = double{m.mu_Pa()}, lambda = double{m.lambda_Pa()}, t = double{s};
  const std::vector<CubeStrain> found = cube_strains(lattice, {}, {&m, 1}, {}, {}, x);
  ASSERT_EQ(found.size(), 2U);
  for (const CubeStrain& c : found) {
    EXPECT_NEAR(c.J, t, 1e-6);
    EXPECT_NEAR(c.strain(0, 0), (t * t - 1) / 2, 1e-6);
    EXPECT_NEAR(c.strain(1, 1), 0, 1e-6);
    EXPECT_NEAR(c.strain(0, 1), 0, 1e-6);
    EXPECT_NEAR(c.stress_Pa(0, 0), mu * (t - 1 / t) + lambda * (t - 1), 1e-5 * lambda);
    EXPECT_NEAR(c.stress_Pa(1, 1), lambda * (t - 1), 1e-5 * lambda);
    EXPECT_NEAR(c.stress_Pa(1, 2), 0, 1e-5 * lambda);
    EXPECT_NEAR(c.von_mises_Pa(), mu * (t - 1 / t), 2e-5 * lambda);
  }
}

/// A block that begins to turn at once as a whole takes the impulse I w, in the first substep. In the middle
/// of a substep of 1 ms at 1 rad/s arms lie 5e-4 rad back, which matters by its square.
TEST(OutsiderMeasures, TheTorqueOfWhatMovesABodyIsItsChangeOfAngularMomentum) {
  Scene scene = free_block();
  MovedRegion& all = scene.bodies[0].moved.emplace_back();
  all.where.kind = RegionKind::sphere;
  all.where.radius_m = 1;
  all.axis = {0, 0, 1};
  all.pivot_m = Vec3d{0.03, 0, 0};
  all.path = {{1, {}, 57.29577951308232}};
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  simulation.step(nullptr, 0.01);
  const CubeLattice& lattice = simulation.bodies()[0]->shape().lattice;
  double inertia = 0;
  Vec3d first{};
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3d arm = vec_cast<double>(lattice.rest_m(i)) - *all.pivot_m;
    const double m = double{lattice.node_mass_kg[static_cast<std::size_t>(i)]};
    inertia += m * (arm.x * arm.x + arm.y * arm.y);
    first += m * arm;
  }
  const auto [force, torque] = simulation.motion_forces()[0][0];
  EXPECT_NEAR(torque.z, inertia / 0.01, 1e-4 * inertia / 0.01);
  EXPECT_NEAR(torque.x, 0, 1e-4 * inertia / 0.01);
  // w x the mass's first moment, turned by 0.01 rad by the end of the frame.
  EXPECT_NEAR(force.y, first.x / 0.01, 1e-3 * std::abs(first.x) / 0.01);
}

/// Free bodies of elements turn as what they are; those that are held or have shape matching keep an eighth
/// of each cube at its corners, 20 % too much for a ball of R / h = 2.5.
TEST(IndependentMass, BodiesOfElementsTurnAsTheySay) {
  BodyDescription body;
  body.name = "ball";
  body.shape.kind = ShapeKind::sphere;
  body.shape.radius_m = 0.025;
  body.spacing_m = 0.01;
  const auto over_closed_form = [&](TissueModel model) {
    body.material.model = model;
    const CubeLattice lattice = make_body_shape(body, {}).lattice;
    double second = 0;
    for (Index i = 0; i < lattice.node_count(); ++i) {
      const Vec3d x = vec_cast<double>(lattice.rest_m(i));
      second += double{lattice.node_mass_kg[static_cast<std::size_t>(i)]} * (x.x * x.x + x.y * x.y);
    }
    return second / (0.4 * lattice.mass_kg() * 0.025 * 0.025);
  };
  EXPECT_NEAR(over_closed_form(TissueModel::tled), 1, 0.02);
  EXPECT_GT(over_closed_form(TissueModel::flsm), 1.15);
  body.cuttable = true;
  EXPECT_NEAR(over_closed_form(TissueModel::tled), 1, 0.02);
  body.cuttable = false;
  FixedRegion& held = body.fixed.emplace_back();
  held.where.kind = RegionKind::sphere;
  held.where.radius_m = 0.01;
  EXPECT_GT(over_closed_form(TissueModel::tled), 1.15);
}

/// v' = g - c v: v = g / c (1 - exp(-c t)). The scheme is of first order: c dt / 2 of it.
TEST(OutsiderMeasures, DragSlowsAFallAsTheClosedForm) {
  Scene scene = free_block();
  scene.gravity_m_s2 = {0, -9.81, 0};
  const double c = scene.bodies[0].material.drag_per_s = 4;
  for (const TissueModel model : {TissueModel::tled, TissueModel::flsm}) {
    scene.bodies[0].material.model = model;
    DeviceSet devices("cpu");
    test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
    double longest_s = 0;
    for (int k = 0; k < 30; ++k)
      longest_s = std::max(longest_s, 0.02 / simulation.step(nullptr, 0.02).substeps);
    const BodyMonitors m = simulation.monitors()[0];
    const double mass = simulation.bodies()[0]->shape().lattice.mass_kg();
    const double expected = -9.81 / c * (1 - std::exp(-c * 0.6));
    EXPECT_NEAR(m.momentum_kg_m_s.y / mass, expected, c * longest_s * std::abs(expected));
    EXPECT_LT(expected, -2);
  }
}

}  // namespace
}  // namespace tactus
