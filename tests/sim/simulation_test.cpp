#include "tactus/sim/simulation.h"

#include <gtest/gtest.h>

#include "support/device_sets.h"
#include "tactus/base/error.h"
#include "tactus/rig/synthetic_source.h"

namespace tactus {
namespace {

/// A ball comes down on a slab that is held at both ends.
Scene slab_scene() {
  Scene scene;
  scene.name = "slab";
  scene.reconstruction.resolution = 40;
  BodyDescription slab;
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
    slab.fixed.push_back(end);
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

Result press(const std::string& devices_text) {
  DeviceSet devices(devices_text, 5);
  Simulation simulation(devices, slab_scene(), make_synthetic_rig(), {});
  Result result;
  for (int k = 0; k <= 20; ++k) {  // 0.5 m/s down to 10 cm below the slab's top
    const double y_m = std::max(0.35 - 0.5 * k / 30, 0.2);
    result.report = simulation.step(ball_frame(y_m, k / 30.0), k == 0 ? 0 : 1.0 / 30);
    EXPECT_EQ(result.report.status, "");
  }
  result.probes = simulation.probe_positions_m();
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

TEST(Simulation, WithoutContactTheSlabStaysAtRest) {
  DeviceSet devices("cpu");
  Simulation simulation(devices, slab_scene(), make_synthetic_rig(), {});
  const std::vector<Vec3f> before = simulation.probe_positions_m();
  for (int k = 0; k < 5; ++k) simulation.step(ball_frame(0.6, k / 30.0), k == 0 ? 0 : 1.0 / 30);
  const std::vector<Vec3f> after = simulation.probe_positions_m();
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_LT(length(after[i] - before[i]), 1e-5F);  // 2e-4 of a cube
}

/// A cube of 0.2 m as a mesh body.
BodyAssets cube_asset(float scale, bool inside_out) {
  TriangleMesh mesh;
  for (int q = 0; q < 8; ++q)
    mesh.positions_m.push_back(
        scale * Vec3f{(q & 1) != 0 ? 0.1F : -0.1F, (q & 2) != 0 ? 0.1F : -0.1F, (q & 4) != 0 ? 0.1F : -0.1F});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  if (inside_out)
    for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
  return {{{"cube", mesh}}, {}};
}
BodyDescription cube_body() {
  BodyDescription body;
  body.name = "cube";
  body.shape.kind = ShapeKind::mesh;
  body.spacing_m = 0.05;
  return body;
}

SpaceRegion ball(Vec3d center_m, double radius_m) {
  SpaceRegion region;
  region.kind = RegionKind::sphere;
  region.center_m = center_m;
  region.radius_m = radius_m;
  return region;
}

TEST(BodyShape, OddMeshesAreNamed) {
  EXPECT_TRUE(make_body_shape(cube_body(), cube_asset(1, false)).warnings.empty());
  const BodyShape turned = make_body_shape(cube_body(), cube_asset(1, true));
  ASSERT_EQ(turned.warnings.size(), 1U);
  EXPECT_EQ(turned.warnings[0], "its triangles face inwards; they are taken the other way round");
  EXPECT_GT(volume_m3(turned.surface_m), 0);
  BodyDescription large = cube_body();
  large.spacing_m = 50;
  const BodyShape millimetres = make_body_shape(large, cube_asset(1000, false));
  ASSERT_EQ(millimetres.warnings.size(), 1U);
  EXPECT_EQ(millimetres.warnings[0],
            "it is 200 m long: is its file in millimetres? Then say 'unit_m: 0.001'");
  BodyDescription free = cube_body();
  free.fixed.push_back(ball({5, 5, 5}, 0.1));
  EXPECT_EQ(make_body_shape(free, cube_asset(1, false)).warnings.at(0),
            "its 'fixed' regions hold no node: it is free");
}

TEST(BodyShape, RegionsPaintMaterialsAndModels) {
  BodyDescription body = cube_body();
  body.material.model = TissueModel::hybrid;
  PaintedRegion core;
  core.name = "core";
  core.where = ball({}, 0.06);
  core.model = RegionModel::tled;
  core.young_modulus_pa = 50000;
  core.density_kg_m3 = 2000;
  body.regions.push_back(core);
  const BodyShape shape = make_body_shape(body, cube_asset(1, false));
  // 4^3 cubes whose centres are 0.025 or 0.075 from the middle planes: the inner 8 lie within 0.06.
  EXPECT_EQ(std::count(shape.elements.begin(), shape.elements.end(), 1), 8);
  EXPECT_EQ(std::count(shape.material_of_cube.begin(), shape.material_of_cube.end(), 1), 8);
  EXPECT_FLOAT_EQ(shape.materials[1].young_Pa, 50000);
  // 0.2^3 m^3 of water and 8 cubes of 0.05^3 twice as heavy; the surface coincides with cube faces.
  EXPECT_NEAR(shape.lattice.mass_kg(), 8 + 1, 1e-3);
  body.regions[0].where.center_m = {3, 0, 0};
  try {
    make_body_shape(body, cube_asset(1, false));
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "body 'cube': region 0 ('core') holds no cube of the body");
  }
}

/// A body that is pressed to numbers that are no longer finite goes back and rests; the run goes on.
TEST(SoftBody, BlowingUpIsNamedAndSurvived) {
  DeviceSet devices("cpu");
  ExecContext& ctx = devices.context(0);
  BodyDescription description = cube_body();
  description.material.model = TissueModel::tled;
  SoftBody body(ctx, description, cube_asset(1, false), 0.05F);
  body.begin_frame(ctx);
  for (int k = 0; k < 3; ++k) body.step(ctx, 1e-5F, {0, NAN, 0});
  const std::string trouble = body.end_frame(ctx);
  EXPECT_NE(trouble.find("body 'cube' blew up, first seen in cube 0, at rest round ("), std::string::npos)
      << trouble;
  EXPECT_TRUE(body.at_rest());
  for (const Vec3f x : body.positions_m(ctx)) EXPECT_LT(length(x), 0.2F);
  body.step(ctx, 1e-5F, {0, -9.81F, 0});
  EXPECT_EQ(body.end_frame(ctx), "");
}

TEST(Simulation, DepthOpensTheBowlUnlessTheSceneSaysNo) {
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
    Simulation simulation(devices, scene, source.rig(), {});
    EXPECT_EQ(simulation.step(frame, 0).status, "");
    return volume_m3(simulation.snapshot().real);
  };
  // The wall is 4 cm of a ball of 31 cm: a third of the closed half ball.
  EXPECT_GT(volume(false), 2 * volume(true));
  frame.depths_m = {DepthImage(200, 200)};
  scene.reconstruction.depth = true;
  Simulation simulation(devices, scene, source.rig(), {});
  EXPECT_EQ(simulation.step(frame, 0).status, "camera 'tof': the depth image has no valid pixel");
}

TEST(Simulation, AHoleInOneMaskIsRepairedOrOutvotedWhenTheSceneSaysSo) {
  DeviceSet devices("cpu");
  SyntheticOptions options;
  options.figure = "rabbit";
  options.truth = options.depth = false;
  SyntheticSource source(options);
  FrameSet frame;
  ASSERT_EQ(source.next(frame), NextFrame::success);
  Scene scene = slab_scene();
  scene.bodies.clear();
  scene.probes.clear();
  std::string status;
  const auto volume = [&](bool repair, int tolerated) {
    scene.reconstruction.repair_masks = repair;
    scene.reconstruction.tolerated_views = tolerated;
    Simulation simulation(devices, scene, source.rig(), {});
    status = simulation.step(frame, 0).status;
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

TEST(Simulation, UnknownBodyOfAProbeIsNamed) {
  DeviceSet devices("cpu");
  Scene scene = slab_scene();
  scene.probes[0].body = "slob";
  try {
    Simulation simulation(devices, scene, make_synthetic_rig(), {});
    FAIL() << "accepted";
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("probe 'middle': there is no body 'slob'"), std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace tactus
