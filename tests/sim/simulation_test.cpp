#include "tactus/world/world.h"

#include <gtest/gtest.h>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "support/probe_readings.h"
#include "support/synthetic_frame.h"
#include "tactus/base/error.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

/// A ball comes down on a slab that is held at both ends.
Scene slab_scene() {
  Scene scene;
  scene.name = "slab";
  scene.reconstruction.resolution = 40;
  BodyDescription slab;
  slab.material.model = TissueModel::flsm;
  slab.material.half_width = 2;
  slab.name = "slab";
  slab.shape.size_m = {0.8, 0.1, 0.4};
  slab.placement.position_m = {0, 0.25, 0};
  slab.spacing_m = 0.04;
  slab.material.young_modulus_pa = 20000;
  slab.material.density_kg_m3 = 300;
  slab.material.damping = 0.5;
  for (const double side : {-1.0, 1.0}) {
    SpaceRegion end;
    end.kind = RegionKind::half_space;
    end.point_m = {side * 0.36, 0, 0};
    end.normal = {-side, 0, 0};
    slab.fixed.push_back({end});
  }
  scene.bodies.push_back(slab);
  scene.gravity_m_s2 = {0, 0, 0};
  scene.frame.substeps = 8;
  scene.probes.push_back({"middle", "slab", CoordinateFrame::body, {0, 0.05, 0}});
  scene.probes.push_back({"end", "slab", CoordinateFrame::body, {0.4, 0, 0}});
  return scene;
}

/// Silhouettes of a ball of radius 0.15 m whose lowest point is at y_m.
FrameSet ball_frame(double y_m, double time_s) {
  SyntheticOptions options;
  options.figure = "sphere";
  options.shape.scale = 0.6F;  // of 0.25 m
  options.shape.offset_m = {0, static_cast<float>(y_m + 0.15 - 0.5), 0};
  options.depth = options.truth = false;
  SyntheticSource source(options);
  FrameSet frame;
  EXPECT_EQ(source.next(frame), NextFrame::success);
  frame.time_s = time_s;
  return frame;
}

struct Result {
  std::vector<Vec3f> probes, surface;
  StepReport report;
};

Result press(const std::string& devices_text, const Scene& scene = slab_scene()) {
  DeviceSet devices(devices_text, 5);
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  Result result;
  for (int k = 0; k <= 20; ++k) {  // 0.5 m/s down to 10 cm below the slab's top
    const double y_m = std::max(0.35 - 0.5 * k / 30, 0.2);
    result.report = simulation.step(ball_frame(y_m, k / 30.0), k == 0 ? 0 : 1.0 / 30);
    EXPECT_EQ(text_of(result.report.notices), "");
  }
  result.probes = probe_positions_m(simulation);
  result.surface = simulation.snapshot().bodies.at(0).positions_m;
  return result;
}

class SimulationOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(SimulationOnDevices);

TEST_P(SimulationOnDevices, ABallPressesTheSlabAndEveryDeviceAgrees) {
  static const Result on_cpu = press("cpu");
  const Result got = press(GetParam());
  // The ball's lowest point is 10 cm under the slab's rest height of 0.3 m; the middle of the top must be
  // pushed there, to within the hull's voxel (2.5 cm) and half a lattice cube (2 cm).
  EXPECT_LT(got.probes[0].y, 0.3F - 0.1F + 0.045F);
  EXPECT_GT(got.probes[0].y, 0.1F);
  EXPECT_FLOAT_EQ(got.probes[1].y, on_cpu.probes[1].y);
  EXPECT_NEAR(got.probes[1].y, 0.25, 0.03);  // held
  EXPECT_GT(got.report.contact.contacts_per_substep, 0);
  EXPECT_GT(got.report.contact.force_N.y, 0);  // the slab pushes back up
  EXPECT_EQ(got.surface, on_cpu.surface);
  EXPECT_EQ(got.probes, on_cpu.probes);
}

/// What an overflow says to raise is a key of the scene, and enough.
TEST(World, TooLittleCapacityNamesTheKeyThatGivesIt) {
  DeviceSet devices("cpu");
  Scene scene = slab_scene();
  scene.reconstruction.max_vertices = 90;
  const auto status = [&] {
    return text_of(
        test::FilmedWorld(devices, scene, make_synthetic_rig(), {}).step(ball_frame(0.35, 0), 0).notices);
  };
  const std::string reported = ", capacity for 90: raise reconstruction.max_vertices to ";
  const std::string text = status();
  const std::size_t at = text.find(reported);
  ASSERT_NE(at, std::string::npos) << text;
  scene.reconstruction.max_vertices = std::stoi(text.substr(at + reported.size()));
  EXPECT_EQ(status(), "");
}

/// Shape matching in steps of several of the elements': what it alone moves touches the surface where that
/// will be at their end. The ball presses shape matching, half elements of each side.
Scene hybrid_slab_scene(int matching_every) {
  Scene scene = slab_scene();
  BodyDescription& slab = scene.bodies[0];
  slab.material.model = TissueModel::hybrid;
  slab.material.poisson_ratio = 0.45;
  slab.ratio = RatioDescription{4, 6, Axis::x};
  slab.matching_every = matching_every;
  scene.frame.substeps.reset();
  return scene;
}

TEST_P(SimulationOnDevices, ACoarserRateOfShapeMatchingIsPressedAsInLockStep) {
  static const Result lock_step = press("cpu", hybrid_slab_scene(1));
  static const Result on_cpu = press("cpu", hybrid_slab_scene(3));
  const Result got = press(GetParam(), hybrid_slab_scene(3));
  EXPECT_EQ(got.surface, on_cpu.surface);
  EXPECT_EQ(got.report.substeps % 3, 0);
  EXPECT_LT(got.probes[0].y, 0.3F - 0.1F + 0.045F);
  EXPECT_GT(got.report.contact.force_N.y, 0);
  // Nodes that go three substeps at once are three times as deep in the ball when they are put back (2 mm),
  // and that much is what the middle may differ by, up and down: a tenth of a cube.
  std::printf("middle %.5f m, in lock-step %.5f m; deepest correction %.5f m, %.5f m\n",
              static_cast<double>(got.probes[0].y), static_cast<double>(lock_step.probes[0].y),
              static_cast<double>(got.report.contact.max_depth_m),
              static_cast<double>(lock_step.report.contact.max_depth_m));
  EXPECT_NEAR(got.probes[0].y, lock_step.probes[0].y, 0.004);
}

TEST(World, ARateOfShapeMatchingThatCannotBeIsRefused) {
  DeviceSet devices("cpu");
  const auto error_of = [&](const Scene& scene) -> std::string {
    try {
      test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
      simulation.step(ball_frame(0.6, 0), 0);
      simulation.step(ball_frame(0.6, 1 / 30.0), 1 / 30.0);
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::usage);
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(error_of(hybrid_slab_scene(3)), "");
  const std::string soft = error_of(hybrid_slab_scene(64));
  EXPECT_EQ(soft.find("body 'slab': 'matching_every' is 64, but after more than "), 0U) << soft;
  EXPECT_NE(soft.find("its shape matching would be softer than its material; expected at most "),
            std::string::npos)
      << soft;
  Scene scene = hybrid_slab_scene(3);
  scene.frame.substeps = 100;
  EXPECT_EQ(error_of(scene),
            "body 'slab': 'frame.substeps' is 100, expected a multiple of its 'matching_every', 3");
}

TEST(World, WithoutContactTheSlabStaysAtRest) {
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, slab_scene(), make_synthetic_rig(), {});
  const std::vector<Vec3f> before = probe_positions_m(simulation);
  for (int k = 0; k < 5; ++k) simulation.step(ball_frame(0.6, k / 30.0), k == 0 ? 0 : 1.0 / 30);
  const std::vector<Vec3f> after = probe_positions_m(simulation);
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_LT(length(after[i] - before[i]), 1e-5F);  // 2e-4 of a cube
}

TEST(World, DepthOpensTheBowlUnlessTheSceneSaysNo) {
  DeviceSet devices("cpu");
  SyntheticOptions options;
  options.figure = "bowl";
  options.truth = false;
  SyntheticSource source(options);
  FrameSet frame;
  ASSERT_EQ(source.next(frame), NextFrame::success);
  Scene scene = slab_scene();
  scene.bodies.clear();
  scene.probes.clear();
  const auto volume = [&](bool depth) {
    scene.reconstruction.depth = depth;
    test::FilmedWorld simulation(devices, scene, source.rig(), {});
    EXPECT_EQ(text_of(simulation.step(frame, 0).notices), "");
    return volume_m3(simulation.snapshot().real);
  };
  // The wall is 4 cm of a ball of 31 cm: a third of the closed half ball.
  EXPECT_GT(volume(false), 2 * volume(true));
  frame.depths_m = {DepthImage(200, 200)};
  scene.reconstruction.depth = true;
  test::FilmedWorld simulation(devices, scene, source.rig(), {});
  EXPECT_EQ(text_of(simulation.step(frame, 0).notices), "camera 'tof': the depth image has no valid pixel");
}

TEST_P(SimulationOnDevices, TheSurfaceIsSmoothedWhereTheSceneAsksForIt) {
  Scene scene = slab_scene();
  scene.bodies.clear();
  scene.probes.clear();
  scene.reconstruction.smooth = 4;
  const FrameSet frame = ball_frame(0.3, 0);
  const Rig rig = SyntheticSource({.figure = "sphere"}).rig();
  DeviceSet cpu("cpu"), devices(GetParam(), 3);
  SurfacePipeline alone(
      cpu, rig.cameras, {},
      {.hull = {.workspace_m = rig.workspace_m, .resolution = scene.reconstruction.resolution},
       .smoothing_steps = 4});
  alone.make(frame.silhouettes);
  test::FilmedWorld simulation(devices, scene, rig, {});
  for (int k = 0; k < 3; ++k) simulation.step(frame, 1.0 / 30);  // the later ones are replayed
  const TriangleMesh seen = simulation.snapshot().real, expected = alone.download();
  EXPECT_EQ(seen.triangles, expected.triangles);
  EXPECT_EQ(seen.positions_m, expected.positions_m);
  EXPECT_EQ(seen.normals, expected.normals);
  EXPECT_NE(seen.positions_m, alone.hull().download().positions_m);
}

TEST(World, AHoleInOneMaskIsRepairedOrOutvotedWhenTheSceneSaysSo) {
  DeviceSet devices("cpu");
  test::SyntheticFrame seen = test::silhouettes_of("rabbit");
  const Rig& rig = seen.rig;
  FrameSet& frame = seen.frame;
  Scene scene = slab_scene();
  scene.bodies.clear();
  scene.probes.clear();
  std::string status;
  const auto volume = [&](bool repair, int tolerated) {
    scene.reconstruction.repair_masks = repair;
    scene.reconstruction.tolerated_views = tolerated;
    test::FilmedWorld simulation(devices, scene, rig, {});
    status = text_of(simulation.step(frame, 0).notices);
    return volume_m3(simulation.snapshot().real);
  };
  const double whole = volume(true, 0);
  EXPECT_EQ(status, "");
  for (Index y = 220; y < 290; ++y) {
    for (Index x = 290; x < 360; ++x) frame.silhouettes[4].clear(x, y);
  }
  EXPECT_LT(volume(false, 0), 0.9 * whole);
  EXPECT_NEAR(volume(true, 0) / whole, 1, 0.02);
  EXPECT_NE(status.find("camera 'cam4' carves "), std::string::npos) << status;
  EXPECT_NE(status.find("px of the mask of camera 'cam4' were filled"), std::string::npos) << status;
  EXPECT_GT(volume(false, 1), whole);
}

/// A probe is where it was asked for, and moves with the cube that holds it.
TEST(World, ProbesSitWhereTheyAreAskedFor) {
  DeviceSet devices("cpu");
  Scene scene = slab_scene();
  scene.probes = {{"between", "slab", CoordinateFrame::body, {0.1, 0.013, -0.117}},
                  {"world", "slab", CoordinateFrame::world, {0.1, 0.263, -0.117}},
                  {"face", "slab", CoordinateFrame::body, {0.03, 0.05, 0.2}}};
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  const std::vector<Vec3f> at = probe_positions_m(simulation);
  // Rounding of numbers below 1 m, a few times: 1e-6.
  EXPECT_LT(length(at[0] - Vec3f{0.1F, 0.263F, -0.117F}), 1e-6F);
  EXPECT_LT(length(at[1] - at[0]), 1e-6F);
  EXPECT_LT(length(at[2] - Vec3f{0.03F, 0.3F, 0.2F}), 1e-6F);
  // Trilinear: a point of an affinely deformed lattice is deformed in the same way.
  const BodyShape& shape = simulation.bodies()[0]->shape();
  const Mat3f A{{{1.1F, 0.2F, 0}, {0, 0.9F, 0.1F}, {-0.1F, 0, 1.2F}}};
  std::vector<Vec3f> moved;
  for (const Vec3f x : shape.lattice.rest_positions_m()) moved.push_back(A * x + Vec3f{0.01F, 0.02F, 0.03F});
  const Vec3f rest{0.1F, 0.263F, -0.117F};
  const PointInBody point = place_point(shape, MeshFill::closed, rest);
  EXPECT_LT(length(point.point.position_m(moved) - (A * rest + Vec3f{0.01F, 0.02F, 0.03F})), 1e-6F);
}

TEST(World, ProbesOutsideTheirBodyAreRefusedWithTheNearestPoint) {
  DeviceSet devices("cpu");
  Scene scene = slab_scene();
  const auto message = [&](CoordinateFrame frame, Vec3d at_m) {
    scene.probes = {{"far", "slab", frame, at_m}};
    return test::message_of([&] { test::FilmedWorld(devices, scene, make_synthetic_rig(), {}); });
  };
  EXPECT_EQ(message(CoordinateFrame::body, {0.1, 0.25, 0}),
            "probe 'far': position_m [0.1, 0.25, 0] lies 0.2 m outside body 'slab'; the nearest point of its "
            "surface is [0.1, 0.05, 0] (frame: body)");
  EXPECT_NE(message(CoordinateFrame::world, {0.1, 0.5, 0}).find("is [0.1, 0.3, 0] (frame: world)"),
            std::string::npos);
  // A tenth of a cube (4 mm) is on the surface, at the place that was asked for.
  EXPECT_EQ(message(CoordinateFrame::body, {0.1, 0.0535, 0}), "");
  EXPECT_NE(message(CoordinateFrame::body, {0.1, 0.0545, 0}).find("lies 0.0045 m outside"),
            std::string::npos);
}

TEST(World, UnknownBodyOfAProbeIsNamed) {
  DeviceSet devices("cpu");
  Scene scene = slab_scene();
  scene.probes[0].body = "slob";
  try {
    test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
    FAIL() << "accepted";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("probe 'middle': there is no body 'slob'"), std::string::npos)
        << e.what();
  }
}

/// A state in memory takes a world back: the frames that follow have the same bits.
TEST(World, AStateInMemoryIsGoneOnFrom) {
  DeviceSet devices("cpu");
  Scene scene = slab_scene();
  scene.gravity_m_s2 = {0, -9.81, 0};
  World world(devices, scene, {});
  for (int k = 0; k < 3; ++k) world.step(1. / 30);
  const std::string state = world.save_state();
  const auto next = [&] {
    world.step(1. / 30);
    return world.nodes("slab").positions_m;
  };
  const std::vector<Vec3f> first = next(), second = next();
  world.load_state(state);
  EXPECT_EQ(next(), first);
  EXPECT_EQ(next(), second);
  EXPECT_NE(first, second) << "it moves";
}

TEST(World, NodesOfABodyThatIsNotThereAreRefused) {
  DeviceSet devices("cpu");
  World world(devices, slab_scene(), {});
  EXPECT_EQ(test::message_of([&] { world.nodes("slap"); }, ErrorKind::usage),
            "body 'slap' is not in the scene; did you mean 'slab'?");
}

}  // namespace
}  // namespace tactus
