// Statics: planes of symmetry, rollers, and bodies that begin at rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "support/probe_readings.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/body/body_steps.h"

namespace tactus {
namespace {

constexpr double kH = 1.0 / 32;  ///< a power of two: nodes of two lattices rest at the same floats

SpaceRegion half_space(Vec3d point_m, Vec3d out) {
  SpaceRegion region;
  region.kind = RegionKind::half_space;
  region.frame = CoordinateFrame::world;
  region.point_m = point_m;
  region.normal = out;
  return region;
}

Scene box_scene(Vec3d low_m, Vec3d high_m, TissueModel model) {
  Scene scene;
  scene.reconstruction.resolution = 16;
  scene.gravity_m_s2 = {};
  BodyDescription box;
  box.material.half_width = 2;
  box.name = "box";
  box.shape.size_m = high_m - low_m;
  box.placement.position_m = 0.5 * (low_m + high_m);
  box.spacing_m = kH;
  box.contact = false;
  box.material.model = model;
  box.material.young_modulus_pa = 10000;
  box.material.poisson_ratio = 0.4;
  if (model == TissueModel::hybrid) box.ratio = RatioDescription{6, 4, Axis::z};
  scene.bodies = {box};
  return scene;
}

struct Played {
  std::vector<Vec3f> rest_m, x_m;
  Vec3d momentum_kg_m_s;
  std::vector<CubeStrain> strains;  ///< at the probes
  std::string notices;
};

Played play(const Scene& scene, int frames, const std::string& devices_text = "cpu") {
  DeviceSet devices(devices_text, 3);
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  Played played;
  for (int k = 0; k <= frames; ++k)
    played.notices += text_of(simulation.step(nullptr, k == 0 ? 0 : 1.0 / 60).notices);
  played.x_m = simulation.bodies()[0]->positions_m(devices.context(0));
  played.momentum_kg_m_s = simulation.monitors()[0].momentum_kg_m_s;
  played.strains = probe_strains(simulation);
  played.rest_m = simulation.bodies()[0]->shape().lattice.rest_positions_m();
  return played;
}

/// A bar of 4 x 4 x 10 cubes, clamped at one end and pulled at the other, whole or a quarter of it.
Scene pulled_bar(bool quarter) {
  const double low = quarter ? 0 : -2 * kH;
  Scene scene = box_scene({low, low, 0}, {2 * kH, 2 * kH, 10 * kH}, TissueModel::tled);
  BodyDescription& bar = scene.bodies[0];
  bar.material.damping = 0.1;  // by default it follows the body's size
  bar.fixed.push_back({half_space({0, 0, 0.1 * kH}, {0, 0, 1})});
  if (quarter) {
    bar.fixed.push_back({half_space({0.1 * kH, 0, 0}, {1, 0, 0}), 1});
    bar.fixed.push_back({half_space({0, 0.1 * kH, 0}, {0, 1, 0}), 2});
  }
  LoadedRegion& pull = bar.loads.emplace_back();
  pull.where = half_space({0, 0, 9.9 * kH}, {0, 0, -1});
  pull.traction_pa = Vec3d{0, 0, 1500};
  return scene;
}

/// Nodes of both obey the same equations; those on planes of symmetry have twice or four times the mass and
/// force in the whole. Sums differ by rounding: some 200 substeps, in each a velocity of dx / dt is off by
/// 2^-24 of 0.3 m in x, 2e-8 m, add up to sqrt(200) 2e-8 = 3e-7 m; three times that. It moves by 2 cm.
TEST(OutsiderSupports, AQuarterWithPlanesOfSymmetryMovesAsTheWhole) {
  const Played whole = play(pulled_bar(false), 30), quarter = play(pulled_bar(true), 30);
  int compared = 0;
  float most_m = 0, moved_m = 0;
  for (std::size_t i = 0; i < quarter.x_m.size(); ++i) {
    for (std::size_t j = 0; j < whole.x_m.size(); ++j) {
      if (whole.rest_m[j] != quarter.rest_m[i]) continue;
      ++compared;
      most_m = std::max(most_m, length(whole.x_m[j] - quarter.x_m[i]));
      moved_m = std::max(moved_m, length(whole.x_m[j] - whole.rest_m[j]));
    }
    for (const int axis : {0, 1}) {
      if (quarter.rest_m[i][axis] == 0) {
        EXPECT_EQ(quarter.x_m[i][axis], 0);
      }
    }
  }
  std::printf("%d nodes, %.2g m apart, moved by %.2g m\n", compared, double{most_m}, double{moved_m});
  EXPECT_EQ(compared, 3 * 3 * 11);
  EXPECT_LT(most_m, 1e-6F);
  EXPECT_GT(moved_m, 0.02F);
}

class SupportsOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(SupportsOnDevices);

/// Rollers below, and the load pushes sideways, too: nodes below stay on their plane to the last bit, slide
/// along it, and every device has the same bits.
TEST_P(SupportsOnDevices, NodesOnRollersSlideAndEveryDeviceAgrees) {
  for (const TissueModel model : {TissueModel::tled, TissueModel::flsm, TissueModel::hybrid}) {
    Scene scene = box_scene({0, 0, 0}, {2 * kH, 3 * kH, 24 * kH}, model);
    BodyDescription& bar = scene.bodies[0];
    bar.fixed.push_back({half_space({0, 0.1 * kH, 0}, {0, 1, 0}), 2});
    LoadedRegion& push = bar.loads.emplace_back();
    push.where = half_space({0, 2.9 * kH, 0}, {0, -1, 0});
    push.traction_pa = Vec3d{30, -200, 20};
    const Played found = play(scene, 4, GetParam());
    for (std::size_t i = 0; i < found.x_m.size(); ++i) {
      if (found.rest_m[i].y != 0) continue;
      EXPECT_EQ(found.x_m[i].y, 0);
    }
    // Nothing holds it along x: all that pushes becomes momentum, by sums of floats.
    const double pushed_N_s = 30 * 2 * kH * 24 * kH * 4 / 60;
    EXPECT_NEAR(found.momentum_kg_m_s.x, pushed_N_s, 1e-4 * pushed_N_s);
    EXPECT_EQ(found.x_m, play(scene, 4).x_m);
  }
}

/// The stretch s across of a cube pressed to l: mu (s - 1/s) + lambda (J - 1) J / s = 0, J = l s^2; the force
/// per area at rest along it.
double across(double l, double mu, double lambda) {
  double low = 0.5, high = 2;
  for (int k = 0; k < 60; ++k) {
    const double s = 0.5 * (low + high), J = l * s * s;
    (mu * (s - 1 / s) + lambda * (J - 1) * J / s > 0 ? high : low) = s;
  }
  return low;
}

/// On a roller below, between two planes of symmetry, pressed from above: the same strain everywhere. What is
/// left of the load is a thousandth of it, as vectors over nodes, maybe over all 120 where the load is on 24:
/// sqrt(5) thousandths, in a quarter of a wave, which gives way 4 / pi times as much: 0.3 % of the largest
/// way.
TEST(OutsiderSupports, ABlockOnRollersIsPressedAsTheClosedForm) {
  Scene scene = box_scene({0, 0, 0}, {3 * kH, 4 * kH, 5 * kH}, TissueModel::tled);
  scene.frame.start = FrameStart::settled;
  BodyDescription& block = scene.bodies[0];
  for (const int axis : {0, 1, 2}) {
    Vec3d point, out;
    point[axis] = 0.1 * kH, out[axis] = 1;
    block.fixed.push_back({half_space(point, out), static_cast<HeldAxes>(1 << axis)});
  }
  const double mu = 10000 / 2.8, lambda = 10000 * 0.4 / (1.4 * 0.2), l = 0.8, s = across(l, mu, lambda);
  const double J = l * s * s, pressed_Pa = mu * (l - 1 / l) + lambda * (J - 1) * J / l;
  LoadedRegion& push = block.loads.emplace_back();
  push.where = half_space({0, 3.9 * kH, 0}, {0, -1, 0});
  push.traction_pa = Vec3d{0, pressed_Pa, 0};
  scene.probes.push_back({"inside", "box", CoordinateFrame::world, {1.3 * kH, 2.2 * kH, 2.9 * kH}});
  scene.probes.push_back({"corner", "box", CoordinateFrame::world, {3 * kH, 4 * kH, 5 * kH}});
  const Played played = play(scene, 0);
  EXPECT_EQ(played.notices, "");
  ASSERT_EQ(played.strains.size(), 2U);
  for (const CubeStrain& found : played.strains) {  // of half a percent of strain what is left of it below
    EXPECT_NEAR(found.strain(1, 1), 0.5 * (l * l - 1), 5e-3 * (1 - l));
    EXPECT_NEAR(found.strain(0, 0), 0.5 * (s * s - 1), 5e-3 * (1 - l));
    EXPECT_NEAR(found.strain(0, 1), 0, 5e-3 * (1 - l));
    EXPECT_NEAR(found.stress_Pa(1, 1), pressed_Pa * l / J, 5e-3 * -pressed_Pa);
    EXPECT_NEAR(found.stress_Pa(0, 0), 0, 5e-3 * -pressed_Pa);
    EXPECT_NEAR(found.stress_Pa(1, 2), 0, 5e-3 * -pressed_Pa);
    EXPECT_NEAR(found.von_mises_Pa(), -pressed_Pa * l / J, 5e-3 * -pressed_Pa);
    EXPECT_NEAR(found.J, J, 5e-3 * (1 - l));
  }
  const double most_m = 3e-3 * (1 - l) * 4 * kH;
  for (std::size_t i = 0; i < played.x_m.size(); ++i) {
    const Vec3d rest = vec_cast<double>(played.rest_m[i]), x = vec_cast<double>(played.x_m[i]);
    EXPECT_NEAR(x.y, l * rest.y, most_m);
    EXPECT_NEAR(x.x, s * rest.x, most_m);
    EXPECT_NEAR(x.z, s * rest.z, most_m);
  }
}

/// A cantilever of 20 x 4 x 4 cubes under its weight, slack: undamped otherwise, it would swing for minutes.
Scene beam_scene(double young_Pa) {
  Scene scene = box_scene({0, 0, 0}, {20 * kH, 4 * kH, 4 * kH}, TissueModel::tled);
  BodyDescription& beam = scene.bodies[0];
  beam.material.young_modulus_pa = young_Pa;
  beam.fixed.push_back({half_space({0.1 * kH, 0, 0}, {1, 0, 0})});
  scene.gravity_m_s2 = {0, -9.81, 0};
  return scene;
}

/// Against the same beam that swung for a minute under drag: exp(-0.5 c t) of its first swing is left,
/// nothing. A thousandth of the force that is left, all of it in the first mode, which has 0.78 of the load's
/// vector (its participation) and 0.97 of the sag: 1.3 thousandths, and rounding of 0.6 m by 2^-24 in each of
/// 20 cubes. Its first frame shows it at rest, at 0 s.
TEST(OutsiderSettling, ABeamBeginsAtItsStaticSag) {
  for (const double young_Pa : {1e5, 1e6}) {
    Scene scene = beam_scene(young_Pa), slow = scene;
    slow.bodies[0].material.drag_per_s = 6;
    scene.frame.start = FrameStart::settled;
    DeviceSet devices("cpu");
    test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
    const StepReport report = simulation.step(nullptr, 0);
    EXPECT_EQ(text_of(report.notices), "");
    EXPECT_EQ(report.substeps, 0);
    const Played swung = play(slow, 600);
    const std::vector<Vec3f> settled = simulation.bodies()[0]->positions_m(devices.context(0));
    float sag_m = 0, apart_m = 0;
    for (std::size_t i = 0; i < settled.size(); ++i) {
      sag_m = std::max(sag_m, swung.rest_m[i].y - swung.x_m[i].y);
      apart_m = std::max(apart_m, length(swung.x_m[i] - settled[i]));
    }
    const int of_frame = simulation.bodies()[0]->steps().substeps_for(1 / 30.F);
    std::printf("%g Pa: sag %.4g m, %.2g m apart, %d substeps, %.1f frames' work\n", young_Pa, double{sag_m},
                double{apart_m}, report.settling_substeps,
                report.settling_substeps / static_cast<double>(of_frame));
    EXPECT_LT(apart_m, 2e-3F * sag_m + 1e-6F);
    EXPECT_LE(report.settling_substeps, 200 * of_frame);
    EXPECT_EQ(simulation.monitors()[0].kinetic_J, 0);
    // And it stays: what is left of the force swings it by twice that.
    for (int k = 0; k < 60; ++k) simulation.step(nullptr, 1 / 30.0);
    const std::vector<Vec3f> later = simulation.bodies()[0]->positions_m(devices.context(0));
    for (std::size_t i = 0; i < settled.size(); ++i)
      EXPECT_LT(length(later[i] - settled[i]), 4e-3F * sag_m + 2e-6F);
  }
}

/// Every model, on every device the same bits; what moves it stands as at 0 s.
TEST_P(SupportsOnDevices, SettledBodiesHaveTheSameBits) {
  for (const TissueModel model : {TissueModel::tled, TissueModel::flsm, TissueModel::hybrid}) {
    Scene scene = box_scene({0, 0, 0}, {3 * kH, 3 * kH, 24 * kH}, model);
    scene.bodies[0].material.young_modulus_pa = 100000;
    scene.gravity_m_s2 = {0, -9.81, 0};
    scene.frame.start = FrameStart::settled;
    scene.bodies[0].fixed.push_back({half_space({0, 0, 0.1 * kH}, {0, 0, 1})});
    MovedRegion& grip = scene.bodies[0].moved.emplace_back();
    grip.where = half_space({0, 0, 23.9 * kH}, {0, 0, -1});
    grip.path = {{0.1, {0, 0.01, 0}, 0}};
    const Played found = play(scene, 0, GetParam());
    EXPECT_EQ(found.notices, "");
    EXPECT_EQ(found.momentum_kg_m_s, Vec3d{});
    float sag_m = 0;
    for (std::size_t i = 0; i < found.x_m.size(); ++i) {
      sag_m = std::max(sag_m, found.rest_m[i].y - found.x_m[i].y);
      if (found.rest_m[i].z == static_cast<float>(24 * kH)) {
        EXPECT_EQ(found.x_m[i], found.rest_m[i]);
      }
    }
    EXPECT_GT(sag_m, 0.001F);
    EXPECT_EQ(found.x_m, play(scene, 0).x_m);
  }
}

void put_on_a_table(Scene& scene) {
  ObstacleSetting& table = scene.obstacles.emplace_back();
  table.name = "table";
  table.kind = ObstacleShape::plane;
}

/// A bar that lies on a table, cut into slabs of several devices.
TEST_P(SupportsOnDevices, WhatLiesOnATableSettlesWithTheSameBits) {
  Scene scene = box_scene({0, 0, 0}, {3 * kH, 3 * kH, 24 * kH}, TissueModel::tled);
  scene.gravity_m_s2 = {0, -9.81, 0};
  scene.frame.start = FrameStart::settled;
  scene.bodies[0].contact = true;
  put_on_a_table(scene);
  const Played found = play(scene, 2, GetParam());
  EXPECT_EQ(found.notices, "");
  EXPECT_EQ(found.x_m, play(scene, 2).x_m);
}

/// Stresses that relax have: mu is half of that at once, lambda is not. Each sag is right to 1.3 thousandths.
TEST(OutsiderSettling, ViscoelasticBodiesBeginRelaxed) {
  Scene fading = beam_scene(1e5), relaxed = fading;
  fading.bodies[0].material.relaxation = {{0.5, 20}};
  MaterialDescription& m = relaxed.bodies[0].material;
  const double mu = 0.5 * 1e5 / 2.8, lambda = 1e5 * 0.4 / (1.4 * 0.2);
  m.young_modulus_pa = mu * (3 * lambda + 2 * mu) / (lambda + mu);
  m.poisson_ratio = lambda / (2 * (lambda + mu));
  fading.frame.start = relaxed.frame.start = FrameStart::settled;
  const Played a = play(fading, 0), b = play(relaxed, 0);
  float sag_m = 0, apart_m = 0;
  for (std::size_t i = 0; i < a.x_m.size(); ++i) {
    sag_m = std::max(sag_m, length(b.x_m[i] - b.rest_m[i]));
    apart_m = std::max(apart_m, length(a.x_m[i] - b.x_m[i]));
  }
  EXPECT_EQ(a.notices + b.notices, "");
  EXPECT_GT(sag_m, 0.6F);
  EXPECT_LT(apart_m, 2.6e-3F * sag_m);
}

/// Resting on a table, it presses on it by its weight in the first frame that passes.
TEST(OutsiderSettling, ABlockBeginsAtRestOnATable) {
  Scene scene = box_scene({0, 0, 0}, {3 * kH, 3 * kH, 3 * kH}, TissueModel::tled);
  scene.gravity_m_s2 = {0, -9.81, 0};
  scene.frame.start = FrameStart::settled;
  scene.bodies[0].contact = true;
  put_on_a_table(scene);
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  EXPECT_EQ(text_of(simulation.step(nullptr, 0).notices), "");
  const StepReport report = simulation.step(nullptr, 1 / 30.0);
  const double weight_N = 9.81 * 1000 * std::pow(3 * kH, 3);
  ASSERT_EQ(report.contacts.size(), 1U);
  EXPECT_NEAR(-double{report.contacts[0].reaction.force_N.y}, weight_N, 0.01 * weight_N);
}

TEST(OutsiderSettling, WhatCannotRestIsNamed) {
  Scene scene = box_scene({0, 0, 0}, {2 * kH, 2 * kH, 4 * kH}, TissueModel::tled);
  scene.gravity_m_s2 = {0, -9.81, 0};
  scene.frame.start = FrameStart::settled;
  EXPECT_EQ(test::message_of([&] { play(scene, 0); }, ErrorKind::usage),
            "'frame.start' is settled, but nothing holds body 'box': expected 'fixed', 'moved' or an "
            "obstacle, or start: undeformed");
  scene.bodies[0].fixed.push_back({half_space({0.1 * kH, 0, 0}, {1, 0, 0}), 1});  // it slides down
  const std::string notices = play(scene, 0).notices;
  EXPECT_NE(notices.find("body 'box' is not at rest after"), std::string::npos) << notices;
}

/// Drag is damping proportional to mass: what swings fades as exp(-c t / 2), whatever its frequency. A beam
/// that gravity takes hold of at 0 s, its first mode at 5.2 Hz. In the tip's way the next has 2 %, and frames
/// of 1/240 s miss a peak by 0.2 %.
TEST(OutsiderSettling, SwingsFadeByDrag) {
  Scene scene = beam_scene(1e7), settled = scene;
  settled.frame.start = FrameStart::settled;
  scene.bodies[0].material.damping = 0;
  scene.bodies[0].material.drag_per_s = 2;
  scene.probes.push_back({"tip", "box", CoordinateFrame::world, {20 * kH, 2 * kH, 2 * kH}});
  settled.probes = scene.probes;
  DeviceSet devices("cpu");
  test::FilmedWorld at_rest(devices, settled, make_synthetic_rig(), {}),
      swings(devices, scene, make_synthetic_rig(), {});
  at_rest.step(nullptr, 0);
  const double middle_m = double{probe_positions_m(at_rest)[0].y};
  double early_m = 0, early_s = 0, late_m = 0, late_s = 0;
  for (int k = 0; k <= 240; ++k) {
    swings.step(nullptr, k == 0 ? 0 : 1 / 240.0);
    const double away_m = std::abs(double{probe_positions_m(swings)[0].y} - middle_m), now_s = k / 240.0;
    if (k > 0 && now_s < 0.2 && away_m > early_m) early_m = away_m, early_s = now_s;
    if (now_s > 0.8 && away_m > late_m) late_m = away_m, late_s = now_s;
  }
  EXPECT_NEAR(late_m / early_m, std::exp(-(late_s - early_s)), 0.03);
}

/// What a support forbids is refused.
TEST(OutsiderSupports, WhatIsMovedMayNotLeaveItsSupport) {
  Scene scene = box_scene({0, 0, 0}, {2 * kH, 2 * kH, 4 * kH}, TissueModel::tled);
  BodyDescription& bar = scene.bodies[0];
  bar.fixed.push_back({half_space({0.1 * kH, 0, 0}, {1, 0, 0}), 1});
  MovedRegion& grip = bar.moved.emplace_back();
  grip.where = half_space({0, 0, 3.9 * kH}, {0, 0, -1});
  grip.path = {{1, {0, 0, 0.01}, 0}};
  EXPECT_EQ(play(scene, 1).notices, "");
  grip.path = {{1, {0.01, 0, 0}, 0}};
  EXPECT_EQ(
      test::message_of([&] { play(scene, 1); }),
      "body 'box': 'moved[0]': node 36 of its region is also 'fixed' along x, and its motion leaves that; "
      "expected no turn, and no displacement along x");
}

/// Held along x only, falling on a table: contact moves its nodes along y and z alone.
TEST(OutsiderSupports, ContactKeepsNodesOnTheirSupports) {
  Scene scene = box_scene({0, kH, 0}, {3 * kH, 4 * kH, 3 * kH}, TissueModel::tled);
  scene.gravity_m_s2 = {0, -9.81, 0};
  BodyDescription& block = scene.bodies[0];
  block.contact = true;
  block.material.damping = 0.7;
  block.fixed.push_back({half_space({0.1 * kH, 0, 0}, {1, 0, 0}), 1});
  put_on_a_table(scene);
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  StepReport report;
  for (int k = 0; k <= 60; ++k) report = simulation.step(nullptr, k == 0 ? 0 : 1.0 / 60);
  const std::vector<Vec3f> x = simulation.bodies()[0]->positions_m(devices.context(0));
  const std::vector<Vec3i>& nodes = simulation.bodies()[0]->shape().lattice.nodes;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (nodes[i].x == 0) {
      EXPECT_EQ(x[i].x, 0);
    }
  }
  // At rest to 2 %: damped by 0.7 of critical for a second.
  const double weight_N = 9.81 * 1000 * std::pow(3 * kH, 3);
  ASSERT_EQ(report.contacts.size(), 1U);
  EXPECT_NEAR(-double{report.contacts[0].reaction.force_N.y}, weight_N, 0.02 * weight_N);
}

/// Its bottom is held 10 mm below a floor, so it can't come to rest: contact pushes what its nodes pull back.
/// The force stays at a tenth of the loads, and after 2,000 stops without half of it no more work is done.
/// (It went on for 1,015,400 substeps.)
TEST(Settling, GivesUpWhereTheForceFallsNoMore) {
  Scene scene;
  BodyDescription& slab = scene.bodies.emplace_back();
  slab.name = "slab";
  slab.shape.size_m = {0.05, 0.03, 0.05};
  slab.spacing_m = 0.01;
  slab.material.model = TissueModel::tled;
  slab.material.young_modulus_pa = 1.8e8;
  slab.fixed.push_back({half_space({0, -0.014, 0}, {0, 1, 0})});
  ObstacleSetting& floor = scene.obstacles.emplace_back();
  floor.name = "floor";
  floor.kind = ObstacleShape::plane;
  floor.placement.position_m = {0, -0.005, 0};
  scene.frame.start = FrameStart::settled;
  DeviceSet devices("cpu");
  test::FilmedWorld world(devices, scene, {}, {});
  const StepReport report = world.step(nullptr, 0);
  EXPECT_LT(report.settling_substeps, 20000);
  const auto is_told = [](const Notice& n) { return n.code == "body.unsettled"; };
  EXPECT_EQ(std::count_if(report.notices.begin(), report.notices.end(), is_told), 1);
}

}  // namespace
}  // namespace tactus
