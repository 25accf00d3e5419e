/// Blades that a program moves.
#include <gtest/gtest.h>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "support/sliced_block.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/sim/body/body_cuts.h"

namespace tactus {
namespace {

constexpr double kFrame_s = 1.0 / 30;

/// The sliced block; nobody films it, and its blade is held.
Scene held_scene() {
  Scene scene = parse_scene(kSlicedBlock, "scenes/x.yaml");
  scene.source.kind = SourceKind::none;
  scene.blades[0].held = true;
  scene.blades[0].path.clear();
  return scene;
}

/// At frame f the blade is where the scene's keyframes have it, 0.01 m later.
Rigidd pose_at(int f) {
  return {Mat3d::identity(), {0.3 * std::clamp((f * kFrame_s - 0.1) / 0.4, 0.0, 1.0), 0, 0}};
}

void play(World& world, int from, int to) {
  for (int f = from; f < to; ++f) {
    world.set_pose("slicer", pose_at(f));
    world.step(f > 0 ? kFrame_s : 0);
  }
}

class HeldBlade : public ::testing::TestWithParam<std::string> {};
TACTUS_INSTANTIATE_DEVICES(HeldBlade);

/// Held along the way of the keyframes, it cuts as they do. Its ends differ by the rounding of a float, 3e-8
/// m, which decides no cube: the blade passes 0.01 m from the nearest layer of nodes.
TEST_P(HeldBlade, CutsAsKeyframesDo) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  Scene keyed = parse_scene(kSlicedBlock, "scenes/x.yaml");
  keyed.source.kind = SourceKind::none;
  DeviceSet devices(GetParam());
  World a(devices, held_scene(), {}), b(devices, keyed, {});
  play(a, 0, 17);
  for (int f = 0; f < 17; ++f) b.step(f > 0 ? kFrame_s : 0);
  ASSERT_EQ(a.cuts().size(), 1U);
  ASSERT_EQ(b.cuts().size(), 1U);
  EXPECT_EQ(a.cuts()[0].cut_cubes, b.cuts()[0].cut_cubes);
  EXPECT_EQ(a.impl().bodies()[0]->cuts()->state(a.impl().context()).parts, 2);
  // The block is 0.2 m wide and 0.1 m deep at the blade.
  EXPECT_NEAR(a.cuts()[0].area_m2, b.cuts()[0].area_m2, 1e-6);
  EXPECT_NEAR(a.cuts()[0].area_m2, 0.02, 1e-3) << "the block hangs, so it isn't quite at rest";
}

/// A run that goes on from the middle of a stroke gives the same bits.
TEST_P(HeldBlade, GoesOnFromAnArchive) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  DeviceSet devices(GetParam());
  World whole(devices, held_scene(), {});
  play(whole, 0, 9);
  const std::string kept = whole.save_state();
  play(whole, 9, 17);
  World again(devices, held_scene(), {});
  again.load_state(kept);
  EXPECT_EQ(again.pose("slicer").t, pose_at(8).t);
  play(again, 9, 17);
  EXPECT_EQ(again.cuts()[0].cut_cubes, whole.cuts()[0].cut_cubes);
  EXPECT_EQ(again.impl().bodies()[0]->positions_m(again.impl().context()),
            whole.impl().bodies()[0]->positions_m(whole.impl().context()));
}

/// It stands in the block from the first frame on, where it was put, and jumps out of it: no cut.
TEST(HeldBladeAlone, CutsNothingWhereItIsPutOrJumps) {
  DeviceSet devices("cpu");
  World world(devices, held_scene(), {});
  world.set_pose("slicer", {Mat3d::identity(), {0.15, 0, 0}});
  world.step(0);
  EXPECT_EQ(world.pose("slicer").t.x, 0.15);
  world.set_pose("slicer", {Mat3d::identity(), {0.4, 0, 0}});
  const StepReport report = world.step(kFrame_s);
  ASSERT_FALSE(report.notices.empty());
  EXPECT_EQ(report.notices.back().code, "cut.jump");
  EXPECT_EQ(report.notices.back().text,
            "blade 'slicer' moves by 0.25 m in a frame, expected at most 0.2 m; it cuts nothing there");
  EXPECT_EQ(report.notices.back().remedy, "move it slower, or give frames less time ('frame.dt_s')");
  EXPECT_TRUE(world.cuts().empty());
  world.set_pose("slicer", {Mat3d::identity(), {0.15, 0, 0}}, true);  // back into it, put down there
  world.step(kFrame_s);
  EXPECT_TRUE(world.cuts().empty());
  world.set_pose("slicer", {Mat3d::identity(), {0.3, 0, 0}});
  world.step(kFrame_s);
  EXPECT_FALSE(world.cuts().empty()) << "from there it cuts";
  // Its steel is where its edge is.
  const FrameSnapshot seen = world.snapshot();
  ASSERT_EQ(seen.blades.size(), 1U);
  EXPECT_NEAR(bounds(seen.blades[0]).center().x, 0.15F, 0.03F);
}

TEST(HeldBladeAlone, RefusesWrongNamesPosesAndKeys) {
  DeviceSet devices("cpu");
  World world(devices, held_scene(), {});
  EXPECT_EQ(test::message_of([&] { world.set_pose("slicr", {}); }, ErrorKind::usage),
            "'slicr' is no obstacle or blade with 'held: true'; did you mean 'slicer'?");
  Rigidd mirrored{Mat3d::identity(), {}};
  mirrored.R(0, 0) = -1;
  EXPECT_EQ(test::message_of([&] { world.set_pose("slicer", mirrored); }, ErrorKind::usage),
            "pose of blade 'slicer': R mirrors, expected a rotation");
  const auto error_of = [](const std::string& more, const std::string& at) {
    std::string text = kSlicedBlock;
    text.insert(text.find(at), more);
    return test::message_of([&] { parse_scene(text, "scenes/x.yaml"); }, ErrorKind::usage);
  };
  EXPECT_NE(error_of("held: true\n    ", "from_m").find("'path'"), std::string::npos);
  Scene moved = parse_scene(kSlicedBlock, "scenes/x.yaml");
  World keyed(devices, moved, {});
  EXPECT_EQ(test::message_of([&] { keyed.set_pose("slicer", {}); }, ErrorKind::usage),
            "'slicer' is no obstacle or blade with 'held: true'; the scene has none");
}

}  // namespace
}  // namespace tactus
