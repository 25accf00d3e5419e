// Elements in cases that someone else tried.
#include <gtest/gtest.h>

#include <cstdio>

#include "support/message_of.h"
#include "tactus/tissue/body_monitors.h"
#include "tissue/tled_bodies.h"

namespace tactus {
namespace {

struct Twisted {
  double torque_N_m = 0, hourglass_share = 0;
};

/// A bar of 0.1 x 0.02 x 0.02 m with so many cubes across, both ends held, the far one turned about x.
Twisted twist(Index across, float angle_rad) {
  const float h = 0.02F / static_cast<float>(across), side = 0.02F;
  CubeLattice lattice = box({5 * across, across, across}, h);
  std::vector<Vec3f> x = lattice.rest_positions_m();
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const Vec3i n = lattice.nodes[at(i)];
    const float part = static_cast<float>(n.x) / static_cast<float>(5 * across);
    if (n.x == 0 || n.x == 5 * across) lattice.fixed[at(i)] = kAllAxes;
    const Vec3f middle{0, side / 2, side / 2}, from = x[at(i)] - middle;
    x[at(i)] = middle + rotation_matrix(axis_angle({1, 0, 0}, part * angle_rad)) * from;
  }
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const ElasticMaterial m{.young_Pa = 30000, .poisson = 0.45F};
  const TledOptions options{.law = MaterialLaw::isochoric_neo_hookean, .damping_ratio = 0.3F};
  Tled tled(ctx, lattice, {&m, 1}, {}, options);
  BodyState body = rest_state(ctx, lattice);
  body.x_m = to_device(ctx, x);
  // Shear waves (3.2 m/s) cross the half bar in 16 ms: at a drag of 200/s what rings is gone in 0.2 s.
  const float dt = 0.6F * tled.stable_step_s();
  tled.step(ctx, body, {dt, {}, 200}, static_cast<int>(0.3F / dt));
  const std::vector<Vec3f> f = forces(ctx, tled, lattice, to_host(ctx, body.x_m.const_view()));
  x = to_host(ctx, body.x_m.const_view());
  Twisted found;
  for (Index i = 0; i < lattice.node_count(); ++i) {
    if (lattice.nodes[at(i)].x != 5 * across) continue;
    const Vec3d from = vec_cast<double>(x[at(i)]) - Vec3d{0, 0.01, 0.01};
    found.torque_N_m -= cross(from, vec_cast<double>(f[at(i)])).x;
  }
  const std::vector<Vec3f> v(x.size());
  const BodyMonitors b = measure_body(lattice, {}, {&m, 1}, {}, options, x, v);
  found.hourglass_share = b.hourglass_J / (b.elastic_J + b.hourglass_J);
  return found;
}

/// CalculiX 2.20 with quadratic elements (C3D20R), 4 and 6 across: 3.7081 and 3.7041 mN m.
TEST(OutsiderTorsion, ABarTwistsAsInCalculiX) {
  for (const Index across : {4, 8}) {
    const Twisted t = twist(across, 0.5F * kPi);
    std::printf("%d across: torque %+.2f %%, hourglass energy %.1f %%\n", across,
                100 * (t.torque_N_m / 3.703e-3 - 1), 100 * t.hourglass_share);
    EXPECT_NEAR(t.torque_N_m, 3.703e-3, 0.05 * 3.703e-3) << across;
    EXPECT_LT(t.hourglass_share, 0.10) << across;
  }
}

/// Cubes that resist shear more than swelling: at 0.95 of the step that is reported, the scheme keeps kinetic
/// energy below 1 / (1 - 0.95^2) = 10.3 times what was put in, with a margin 12; what is unstable overflows.
TEST(OutsiderNegativePoisson, ReportedStepsAreStable) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const TledOptions options{.law = MaterialLaw::isochoric_neo_hookean, .damping_ratio = 0};
  for (const float poisson : {-0.1F, -0.3F, -0.5F, -0.9F}) {
    const ElasticMaterial m{.young_Pa = 3000, .poisson = poisson};
    for (const CubeLattice& lattice : {box({1, 1, 1}), box({1, 1, 12}), box({6, 6, 6})}) {
      Tled tled(ctx, lattice, {&m, 1}, {}, options);
      for (const bool measured : {false, true}) {
        if (measured) tled.measure_stable_step(ctx, lattice, 100);
        const std::vector<Vec3f> x = shaken(lattice, 1e-3F * kH, 2);
        std::vector<Vec3f> v(x.size());
        for (std::size_t i = 0; i < x.size(); ++i)
          v[i] = 100.F * (x[i] - lattice.rest_m(static_cast<Index>(i)));
        BodyState body = rest_state(ctx, lattice);
        body.v_m_s = to_device(ctx, v);
        const double energy = kinetic_J(ctx, lattice, body);
        tled.step(ctx, body, {0.95F * tled.stable_step_s(), {}}, 3000);
        EXPECT_LT(kinetic_J(ctx, lattice, body), 12 * energy) << poisson << ' ' << lattice.cube_count();
      }
    }
  }
}

/// Their energy falls without bound as J grows: no step is stable for long.
TEST(OutsiderNegativePoisson, LawsWithoutALeastEnergyRefuse) {
  DeviceSet set("cpu");
  const ElasticMaterial m{.poisson = -0.3F};
  for (const MaterialLaw law : {MaterialLaw::neo_hookean, MaterialLaw::transversely_isotropic}) {
    EXPECT_EQ(test::message_of([&] {
                Tled(set.context(0), box({2, 2, 2}), {&m, 1}, {}, {.law = law});
              }),
              "Poisson's ratio is -0.3, expected 0 or more with this law, as its energy has no least value "
              "below; law isochoric_neo_hookean takes -1 to 0.5");
  }
}

}  // namespace
}  // namespace tactus
