/// How many steps and iterations a scene's liquid takes, and how it begins.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include "support/filmed_world.h"

namespace tactus {
namespace {

/// (Inlined, it makes GCC 12 warn of vectors that nobody made.)
[[gnu::noinline]] LiquidDescription& add_liquid(Scene& scene) { return scene.fluid.emplace(); }

/// A stiff body needs 369 substeps a frame, a soft one 37. The pool beside them, which neither touches, needs
/// neither: it takes the same steps as alone, and has the same bits.
TEST(LiquidScene, TakesStepsOfItsOwnBesideAStiffBody) {
  const auto run = [](double young_pa) {
    Scene scene;
    LiquidDescription& pool = add_liquid(scene);
    pool.spacing_m = 0.01;
    pool.box = {{-0.05, 0, -0.05}, {0.05, 0.3, 0.05}};
    pool.blocks.push_back({{{-0.05, 0, -0.05}, {0.03, 0.05, 0.05}}, {}});
    pool.max_speed_m_s = 1.5;
    if (young_pa > 0) {
      BodyDescription& body = scene.bodies.emplace_back();
      body.name = "b";
      body.shape.size_m = {0.06, 0.04, 0.06};
      body.placement.position_m = {0, 0.2, 0};
      body.spacing_m = 0.01;
      body.material.model = TissueModel::tled;
      body.material.young_modulus_pa = young_pa;
      FixedRegion& top = body.fixed.emplace_back();
      top.where.kind = RegionKind::half_space;
      top.where.frame = CoordinateFrame::world;
      top.where.point_m = {0, 0.19, 0};
    }
    DeviceSet devices("cpu");
    test::FilmedWorld simulation(devices, scene, {}, {});
    struct {
      std::vector<int> steps;
      std::vector<Vec3f> x_m;
      int substeps = 0;
    } result;
    for (int k = 0; k < 5; ++k) {
      const StepReport report = simulation.step(nullptr, k == 0 ? 0 : 1.0 / 30);
      result.steps.push_back(report.liquid_steps);
      result.substeps = std::max(result.substeps, report.substeps);
    }
    result.x_m = simulation.liquid()->positions_m();
    return result;
  };
  const auto alone = run(0), soft = run(1e4), stiff = run(1e6);
  EXPECT_EQ(alone.substeps, 1);
  EXPECT_GT(stiff.substeps, 5 * soft.substeps);
  EXPECT_EQ(soft.steps, alone.steps);
  EXPECT_EQ(stiff.steps, alone.steps);
  EXPECT_EQ(soft.x_m, alone.x_m);
  EXPECT_EQ(stiff.x_m, alone.x_m);
  EXPECT_GE(alone.steps.back(), 3);
}

/// The pace follows what moves. A block falls: in no frame does a particle go more than 1.5 spacings in a
/// step. The pace begins with that of the highest speed, falls by two fifths a frame, and a frame without
/// time came before. At rest, steps are up to six times as long as those for the highest speed. The settled
/// pool has its middle where a pool of five layers has it, to a tenth of a spacing.
TEST(LiquidScene, PaceFollowsWhatMoves) {
  Scene scene;
  LiquidDescription& pool = add_liquid(scene);
  const double d = 0.01;
  pool.spacing_m = d;
  pool.box = {{0, 0, 0}, {0.1, 0.4, 0.1}};
  pool.blocks.push_back({{{0, 0.1, 0}, {0.05, 0.2, 0.1}}, {}});
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.step(nullptr, 0);
  const int most = static_cast<int>(
      std::ceil(1.0 / 30 / static_cast<double>(simulation.liquid()->liquid().largest_step_s())));
  std::vector<int> steps;
  for (int k = 0; k < 75; ++k) {
    const StepReport report = simulation.step(nullptr, 1.0 / 30);
    steps.push_back(report.liquid_steps);
    const double way_d = double{report.liquid.fastest_m_s} / 30 / report.liquid_steps / d;
    EXPECT_LT(way_d, 1.5) << "frame " << k;
  }
  EXPECT_GE(steps.front(), 0.36 * most);
  EXPECT_LE(steps.back(), (most + 1) / 2);
  Vec3d middle;
  const std::vector<Vec3f> x_m = simulation.liquid()->positions_m();
  ASSERT_EQ(x_m.size(), 500U);
  for (const Vec3f x : x_m) middle += 1.0 / 500 * vec_cast<double>(x);
  EXPECT_NEAR(middle.x, 0.05, 0.1 * d);
  EXPECT_NEAR(middle.z, 0.05, 0.1 * d);
  EXPECT_NEAR(middle.y, 0.025, 0.1 * d);
}

/// A block flies at 1 m/s, all of it alike, so a step may be a spacing long: 3.3 a frame, and 4 with the
/// margin. For 0.4 d / v it would take 10. Five frames bring the pace down. Particles have their distance of
/// rest: iterations stay as few as the scene says.
TEST(LiquidScene, WhatFliesTogetherTakesFewSteps) {
  Scene scene;
  LiquidDescription& block = add_liquid(scene);
  block.spacing_m = 0.01;
  block.box = {{0, 0, 0}, {0.1, 0.5, 0.1}};
  block.blocks.push_back({{{0.03, 0.45, 0.03}, {0.06, 0.48, 0.06}}, {0, -1, 0}});
  block.max_speed_m_s = 1.5;
  scene.gravity_m_s2 = {};
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.step(nullptr, 0);
  for (int k = 0; k < 5; ++k) simulation.step(nullptr, 1.0 / 30);
  for (int k = 0; k < 3; ++k) {
    EXPECT_LE(simulation.step(nullptr, 1.0 / 30).liquid_steps, 4);
    EXPECT_EQ(simulation.liquid()->variant(), 0U);
  }
}

/// A jet of 5 mm and a row of lone drops fall 0.4 m, to 2.9 m/s, on a plate of 2 mm: in a step, they go
/// farther than it is thick. Nothing touches the floor below it. In the last ten of 60 frames, the plate
/// bears all that is there: what still falls weighs as much as the stream's momentum has grown by. So the
/// force is too large by the momentum that the stream began with, 0.3 to 0.6 m/s of the 19.6 m/s that gravity
/// gave in two seconds, 3 %; and by what two drops more or less in ten frames bring.
TEST(LiquidScene, NothingFliesThroughAThinPlate) {
  Scene scene;
  LiquidDescription& rain = add_liquid(scene);
  const double d = 0.005;
  rain.spacing_m = d;
  rain.box = {{-0.1, 0, -0.1}, {0.1, 0.8, 0.1}};
  rain.emitters.push_back({"jet", {0, 0.6, 0}, {0.3, -1, 0.1}, 0.006, 0.3, 0, {}});
  rain.emitters.push_back({"drops", {0.03, 0.6, 0.02}, {0, -1, 0}, 0.4 * d, 0.6, 0, {}});
  ObstacleSetting& plate = scene.obstacles.emplace_back();
  plate.name = "plate";
  plate.kind = ObstacleShape::box;
  plate.size_m = {0.4, 0.002, 0.4};
  plate.placement.position_m = {0, 0.2, 0};
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.step(nullptr, 0);
  double borne_N = 0, weight_N = 0, farthest_m = 0;
  StepReport report;
  for (int k = 0; k < 60; ++k) {
    report = simulation.step(nullptr, 1.0 / 30);
    farthest_m = std::max(farthest_m, double{report.liquid.fastest_m_s} / 30 / report.liquid_steps);
    for (const LiquidReaction& f : report.liquid_forces) {
      EXPECT_NE(f.on, "face -y");
      if (f.on == "plate" && k >= 50) borne_N -= double{f.force_N.y};
    }
    if (k >= 50) weight_N += report.liquid.here * d * d * d * rain.density_kg_m3 * 9.81;
  }
  EXPECT_GT(farthest_m, 0.002);
  std::printf("the plate bears %.3f of the weight\n", borne_N / weight_N);
  EXPECT_NEAR(borne_N / weight_N, 1, 0.05);
}

/// A block of 2,704 particles strikes a plate of 2 mm, 30 degrees steep, at 2.7 m/s, and nothing goes past
/// it. In steps of 1.5 spacings, as lone drops take, it was pressed to 3.5 times its density, and two
/// particles fell through beside the walls of the box; in those of one, it is pressed to 2.5 times.
TEST(LiquidScene, ABlockThatStrikesAPlateStaysAboveIt) {
  Scene scene;
  LiquidDescription& block = add_liquid(scene);
  block.spacing_m = 0.006;
  block.box = {{-0.06, 0, -0.06}, {0.06, 0.6, 0.06}};
  block.blocks.push_back({{{-0.04, 0.45, -0.04}, {0.04, 0.55, 0.04}}, {}});
  ObstacleSetting& plate = scene.obstacles.emplace_back();
  plate.name = "plate";
  plate.kind = ObstacleShape::box;
  plate.size_m = {0.3, 0.002, 0.3};
  plate.placement.position_m = {0, 0.15, 0};
  plate.placement.rotation_deg = {0, 0, 30};
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.step(nullptr, 0);
  double densest = 0;
  for (int k = 0; k < 25; ++k) {
    const StepReport report = simulation.step(nullptr, 1.0 / 30);
    densest = std::max(densest, double{report.liquid.densest});
    for (const LiquidReaction& f : report.liquid_forces) EXPECT_NE(f.on, "face -y") << "frame " << k;
  }
  std::printf("pressed to %.2f of its density\n", densest);
  EXPECT_LT(densest, 3);
}

/// Ten layers fall on a cube of 30 kPa that stands on the floor, and rest round it. What the liquid does to
/// its nodes comes once a step: in steps that follow speeds alone the liquid was twice as dense as at rest,
/// at 0.4 m/s, and the body blew up. With the bound it is 1.02 times as dense, at 0.02 m/s: the limits are a
/// tenth of the way from there, and a fifth.
TEST(LiquidScene, RestsRoundASoftBody) {
  Scene scene;
  LiquidDescription& pool = add_liquid(scene);
  pool.spacing_m = 0.006;
  pool.box = {{-0.05, 0, -0.05}, {0.05, 0.3, 0.05}};
  pool.blocks.push_back({{{-0.05, 0.06, -0.05}, {0.05, 0.12, 0.05}}, {}});
  BodyDescription& cube = scene.bodies.emplace_back();
  cube.name = "cube";
  cube.shape.size_m = {0.05, 0.04, 0.05};
  cube.placement.position_m = {0, 0.02, 0};
  cube.spacing_m = 0.01;
  cube.material.model = TissueModel::tled;
  cube.material.young_modulus_pa = 30000;
  FixedRegion& foot = cube.fixed.emplace_back();
  foot.where.kind = RegionKind::half_space;
  foot.where.point_m = {0, -0.015, 0};
  foot.where.normal = {0, 1, 0};
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.step(nullptr, 0);
  StepReport report;
  for (int k = 0; k < 40; ++k) report = simulation.step(nullptr, 1.0 / 30);
  std::printf("at rest round the cube: %.3f of the density, %.3f m/s, %d steps\n",
              double{report.liquid.densest}, double{report.liquid.fastest_m_s}, report.liquid_steps);
  EXPECT_LT(report.liquid.densest, 1.1);
  EXPECT_LT(report.liquid.fastest_m_s, 0.1);
  EXPECT_TRUE(report.notices.empty());
}

/// The force on the floor under 60 layers in a shaft, over their weight, from the second second on; of each
/// frame, and in the mean. @param density_kg_m3 other rounding, so another column
void check_column(float density_kg_m3, int frames) {
  Scene scene;
  LiquidDescription& column = add_liquid(scene);
  column.spacing_m = 0.01;
  column.density_kg_m3 = density_kg_m3;
  column.viscosity_pa_s = 0.001;
  column.box = {{0, 0, 0}, {0.04, 0.7, 0.04}};
  column.blocks.push_back({{{0, 0, 0}, {0.04, 0.6, 0.04}}, {}});
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.step(nullptr, 0);
  const double weight_N = 960 * 1e-6 * double{density_kg_m3} * 9.81;
  double mean = 0, least = 1e9, most = 0;
  int steps = 0;
  for (int k = 0; k < frames; ++k) {
    const StepReport report = simulation.step(nullptr, 1.0 / 30);
    if (k == 29) steps = report.liquid_steps;
    if (k >= 30) {
      EXPECT_GE(report.liquid_steps, steps - 1) << "in a moment without pressure";
    }
    for (const LiquidReaction& f : report.liquid_forces) {
      if (f.on != "face -y") continue;
      const double share = -double{f.force_N.y} / weight_N;
      if (k < 30) continue;
      mean += share / (frames - 30);
      least = std::min(least, share);
      most = std::max(most, share);
    }
    EXPECT_LT(report.liquid.densest, 1.05);
  }
  std::printf("floor over weight: mean %.3f, %.3f to %.3f\n", mean, least, most);
  EXPECT_NEAR(mean, 1, 0.02);
  EXPECT_NEAR(least, 1, 0.25);
  EXPECT_NEAR(most, 1, 0.25);
}

/// In the mean of a second to 2 %, as 30 frames tell it of what still swings. Of 210 frames of each of six
/// such columns, the least had 0.81 of the weight, the most 1.13. While steps and iterations followed the
/// pressure of the moment, half of the columns were pressed to two or three times their density within eight
/// seconds.
TEST(LiquidScene, ATallColumnBearsItsWeight) { check_column(1000, 60); }

TEST(LiquidScene, TallColumnsRest) {
  if (!std::getenv("TACTUS_LONG_TESTS")) GTEST_SKIP() << "half a minute: set TACTUS_LONG_TESTS=1";
  for (const float density_kg_m3 : {1003.7F, 1004.81F, 1005.55F}) check_column(density_kg_m3, 240);
}

/// d^2 / (8 nu) is 1.3e-5 s at 1000 Pa s, and 0.4 d / v_max 4e-3 s.
TEST(LiquidScene, TellsOfStepsThatViscosityMakesShort) {
  for (const double viscosity_pa_s : {10.0, 1000.0}) {
    Scene scene;
    LiquidDescription& pool = add_liquid(scene);
    pool.spacing_m = 0.01;
    pool.box = {{-0.05, 0, -0.05}, {0.05, 0.3, 0.05}};
    pool.blocks.push_back({{{-0.05, 0, -0.05}, {0.05, 0.05, 0.05}}, {}});
    pool.max_speed_m_s = 1;
    pool.viscosity_pa_s = viscosity_pa_s;
    DeviceSet devices("cpu");
    test::FilmedWorld simulation(devices, scene, {}, {});
    const std::vector<Notice> notices = simulation.step(nullptr, 0).notices;
    const auto is_short = [](const Notice& n) {
      return n.code == "liquid.short_steps" &&
             n.text.find("'fluid.viscosity_pa_s' 1000") != std::string::npos;
    };
    EXPECT_EQ(std::count_if(notices.begin(), notices.end(), is_short), viscosity_pa_s > 10 ? 1 : 0);
  }
}

/// 2 (sigma / (rho g))^(1/2) sin(angle / 2) is 3.3 mm at 90 degrees and 0.056 N/m, 3.3 or 11 spacings. 1 ml
/// covers 3 cm^2 so, and a floor of 1 or 100 cm^2 or not.
TEST(LiquidScene, TellsOfPuddlesThatParticlesDontHold) {
  struct Case {
    double spacing_m, half_m;
    std::optional<bool> film;
    bool is_told;
  };
  for (const Case& c :
       {Case{0.001, 0.05, {}, true}, Case{0.0003, 0.05, {}, false}, Case{0.001, 0.005, {}, false},
        Case{0.001, 0.05, true, false}, Case{0.001, 0.05, false, false}}) {
    Scene scene;
    LiquidDescription& drop = add_liquid(scene);
    drop.spacing_m = c.spacing_m;
    drop.film = c.film;
    drop.surface_tension_n_m = 0.056;
    drop.contact_angle_deg = 90;
    drop.box = {{-c.half_m, 0, -c.half_m}, {c.half_m, 0.06, c.half_m}};
    drop.blocks.push_back({{{-0.005, 0, -0.005}, {0.005, 0.01, 0.005}}, {}});
    DeviceSet devices("cpu");
    test::FilmedWorld simulation(devices, scene, {}, {});
    const std::vector<Notice> notices = simulation.step(nullptr, 0).notices;
    const auto is_thin = [](const Notice& n) {
      return n.code == "liquid.thin_puddle" && n.text.find("0.0033 m high") != std::string::npos;
    };
    EXPECT_EQ(std::count_if(notices.begin(), notices.end(), is_thin), c.is_told ? 1 : 0)
        << c.spacing_m << " " << c.half_m;
  }
}

TEST(LiquidScene, AnEmptyLiquidTakesNoStep) {
  Scene scene;
  LiquidDescription& jet = add_liquid(scene);
  jet.spacing_m = 0.01;
  jet.box = {{0, 0, 0}, {0.1, 0.4, 0.1}};
  EmitterDescription& e = jet.emitters.emplace_back();
  e.name = "e";
  e.position_m = {0.05, 0.3, 0.05};
  e.radius_m = 0.02;
  e.from_s = 0.15;
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.step(nullptr, 0);
  for (int k = 1; k <= 3; ++k) {
    const StepReport report = simulation.step(nullptr, 0.05);
    EXPECT_EQ(report.liquid_steps > 0, k == 3) << k;
  }
  const StepReport report = simulation.step(nullptr, 0.05);
  EXPECT_GT(report.liquid_steps, 0);
  // pi r^2 v t / d^3 = 31.4, less what the pattern fluctuates.
  EXPECT_NEAR(report.liquid.here, 31.4, 4);
}

/// The second block is left out where the first one is: 5 x 5 x 10 of its 10 x 5 x 10 particles. Those beside
/// it share a face with it and stay.
TEST(LiquidScene, OverlappingBlocksFillTheirSpaceOnce) {
  Scene scene;
  scene.gravity_m_s2 = {};
  LiquidDescription& pool = add_liquid(scene);
  pool.spacing_m = 0.01;
  pool.box = {{0, 0, 0}, {0.15, 0.1, 0.1}};
  pool.blocks = {{{{0, 0, 0}, {0.1, 0.05, 0.1}}, {}}, {{{0.05, 0, 0}, {0.15, 0.05, 0.1}}, {}}};
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.step(nullptr, 0);
  const StepReport report = simulation.step(nullptr, 0.01);
  EXPECT_EQ(report.liquid.here, 750);
  EXPECT_LT(report.liquid.densest, 1.01);
  const auto is_it = [](const Notice& n) { return n.code == "liquid.blocks_overlap"; };
  test::FilmedWorld again(devices, scene, {}, {});
  const StepReport first = again.step(nullptr, 0);
  const auto notice = std::find_if(first.notices.begin(), first.notices.end(), is_it);
  ASSERT_NE(notice, first.notices.end());
  EXPECT_EQ(notice->text, "250 particles of 'fluid.blocks' lay in an earlier block and were left out");
}

/// A fall through 0.1 m from a given 90 m/s ends with (90^2 + 2 x 9.81 x 0.1)^(1/2).
TEST(LiquidScene, ItsHighestSpeedCountsGivenVelocities) {
  LiquidDescription liquid;
  liquid.box = {{0, 0, 0}, {0.1, 0.1, 0.1}};
  liquid.blocks = {{{{0, 0, 0}, {0.1, 0.05, 0.1}}, {0, 90, 0}}};
  EXPECT_NEAR(liquid_speed_m_s(liquid, {0, -9.81, 0}), std::sqrt(8100 + 2 * 0.981), 1e-9);
}

}  // namespace
}  // namespace tactus
