#include <gtest/gtest.h>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/synthetic_frame.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

class ObstaclesOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(ObstaclesOnDevices);

/// A block 2 cm above a table of 20 cm; a real ball far from both.
Scene table_scene() {
  Scene scene;
  scene.reconstruction.resolution = 24;
  BodyDescription block;
  block.material.model = TissueModel::flsm;
  block.material.half_width = 2;
  block.name = "block";
  block.shape.size_m = {0.2, 0.1, 0.2};
  block.placement.position_m = {-0.3, 0.27, 0};
  block.spacing_m = 0.05;
  block.material.young_modulus_pa = 20000;
  block.material.density_kg_m3 = 300;
  block.material.damping = 0.7;
  scene.bodies.push_back(block);
  ObstacleSetting table;
  table.name = "table";
  table.kind = ObstacleShape::box;
  table.size_m = {0.6, 0.2, 0.6};
  table.placement.position_m = {-0.3, 0.1, 0};
  scene.obstacles.push_back(table);
  return scene;
}

struct Result {
  std::vector<Vec3f> surface;
  StepReport report;
};

Result fall(const std::string& devices_text) {
  SyntheticOptions options;
  options.figure = "sphere";
  options.shape.scale = 0.4F;
  options.shape.offset_m = {0.3F, 0.2F, 0};
  options.depth = options.truth = false;
  SyntheticSource source(options);
  FrameSet frame;
  EXPECT_EQ(source.next(frame), NextFrame::success);
  DeviceSet devices(devices_text, 5);
  test::FilmedWorld simulation(devices, table_scene(), make_synthetic_rig(), {});
  Result result;
  for (int k = 0; k <= 40; ++k) {
    frame.time_s = k / 30.0;
    result.report = simulation.step(frame, k == 0 ? 0 : 1.0 / 30);
  }
  result.surface = simulation.snapshot().bodies.at(0).positions_m;
  return result;
}

TEST_P(ObstaclesOnDevices, ABlockFallsOnATableAndRestsThere) {
  static const Result on_cpu = fall("cpu");
  const Result got = fall(GetParam());
  ASSERT_EQ(got.report.contacts.size(), 1U);
  EXPECT_EQ(got.report.contacts[0].body, "block");
  EXPECT_EQ(got.report.contacts[0].component, "table");
  const double weight_N = 9.81 * 300 * 0.2 * 0.1 * 0.2;
  EXPECT_NEAR(static_cast<double>(-got.report.contacts[0].reaction.force_N.y), weight_N, 0.05 * weight_N);
  EXPECT_EQ(got.report.contact.force_N, Vec3f{}) << "a table is not real";
  float low = 1;
  for (const Vec3f& p : got.surface) low = std::min(low, p.y);
  EXPECT_NEAR(low, 0.2, 1e-4);
  EXPECT_EQ(got.surface, on_cpu.surface);
}

/// A file in metres that is read as millimetres: a cup of 0.1 mm, which holds nothing.
TEST(Obstacles, ATinyMeshIsTold) {
  for (const float half_m : {0.05F, 5e-5F}) {
    Scene scene = table_scene();
    ObstacleSetting& cup = scene.obstacles.emplace_back();
    cup.name = "cup";
    cup.kind = ObstacleShape::mesh;
    cup.placement.position_m = {0.5, 0.5, 0};
    BodyAssets assets;
    assets.obstacle_meshes["cup"] = box_surface({half_m, half_m, half_m}, {1, 1, 1});
    DeviceSet devices("cpu");
    test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), assets);
    int told = 0;
    for (const Notice& n : simulation.step(nullptr, 0).notices) {
      if (n.code != "obstacle.tiny") continue;
      ++told;
      EXPECT_EQ(n.text, "obstacle 'cup' is only 0.1 mm long");
    }
    EXPECT_EQ(told, half_m < 0.001F ? 1 : 0);
  }
}

}  // namespace
}  // namespace tactus
