/// A run that is stopped and goes on is the run that was not stopped.
#include <gtest/gtest.h>

#include <array>
#include <map>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/body/body_cuts.h"

namespace tactus {
namespace {

/// A ball presses a viscoelastic slab that something turns and a load lets go, a shape-matched block lies on
/// a table, half of each kind falls on it, and elements lie beside them.
Scene all_scene() {
  Scene scene;
  scene.reconstruction.resolution = 32;
  BodyDescription slab;
  slab.material.half_width = 2;
  slab.name = "slab";
  slab.shape.size_m = {0.3, 0.1, 0.9};
  slab.placement.position_m = {0, 0.25, 0};
  slab.spacing_m = 0.05;
  slab.material.model = TissueModel::tled;
  slab.material.relaxation = {{0.4, 0.1}};
  FixedRegion end;
  end.where.kind = RegionKind::half_space;
  end.where.frame = CoordinateFrame::world;
  end.where.point_m = {0, 0, -0.44};
  end.where.normal = {0, 0, 1};
  slab.fixed.push_back(end);
  MovedRegion grip;
  grip.where = end.where;
  grip.where.point_m = {0, 0, 0.44};
  grip.where.normal = {0, 0, -1};
  grip.path = {{0.3, {0, 0.01, 0}, 20}};
  grip.axis = {0, 0, 1};
  grip.release_s = 0.45;
  slab.moved.push_back(grip);
  LoadedRegion load;
  load.where.kind = RegionKind::sphere;
  load.where.radius_m = 0.2;
  load.pressure_pa = 300;
  load.over_time = {{0, 0}, {0.5, 1}};
  slab.loads.push_back(load);
  BodyDescription block = slab;
  block.name = "block";
  block.shape.size_m = {0.15, 0.1, 0.15};
  block.placement.position_m = {0.35, 0.06, 0.3};
  block.material = {};
  block.material.model = TissueModel::flsm;
  block.material.half_width = 2;
  block.fixed.clear();
  block.moved.clear();
  block.loads.clear();
  BodyDescription both = block;
  both.name = "both";
  both.placement.position_m = {0.35, 0.18, 0.3};
  both.material.model = TissueModel::hybrid;
  both.ratio = RatioDescription{1, 1, Axis::y};
  BodyDescription elements = block;
  elements.name = "elements";
  elements.placement.position_m = {0.35, 0.06, -0.3};
  elements.material.model = TissueModel::tled;
  scene.bodies = {slab, block, both, elements};
  scene.contact.self = true;
  ObstacleSetting table;
  table.name = "table";
  scene.obstacles.push_back(table);
  return scene;
}

/// A ball of 0.15 m that comes down by 1.5 cm a frame.
const FrameSet& frame_of(int k) {
  static std::map<int, FrameSet> made;  // for all runs
  if (const auto found = made.find(k); found != made.end()) return found->second;
  SyntheticOptions options;
  options.figure = "sphere";
  options.shape.scale = 0.6F;
  options.shape.offset_m = {0, 0.02F - 0.015F * static_cast<float>(k), 0};
  options.depth = options.truth = false;
  SyntheticSource source(options);
  FrameSet& frame = made[k];
  EXPECT_EQ(source.next(frame), NextFrame::success);
  frame.tick = k;
  frame.time_s = k / 30.0;
  return frame;
}

struct State {
  std::vector<std::vector<Vec3f>> x_m, v_m_s;
  std::vector<Vec3f> liquid_m;
  std::vector<std::array<double, 4>> cuts;  ///< area, due, bled, length on the skin
  std::vector<BodyMonitors> monitors;
  std::vector<int> substeps;
  std::vector<Vec3f> force_N;
};

/// Frames from..to of the ball. @param from the state is read from `file` when it is not 0; then it is
/// written there
State play(const std::string& devices_text, const Scene& scene, int from, int to, std::string& file) {
  DeviceSet devices(devices_text, 3);
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  if (from > 0) {
    StateArchive a(file, "f");
    const FrameSet& last = frame_of(from - 1);
    simulation.archive(a, &last);
  }
  State state;
  for (int k = from; k < to; ++k) {
    const StepReport report = simulation.step(frame_of(k), k == 0 ? 0 : 1.0 / 30);
    state.substeps.push_back(report.substeps);
    state.force_N.push_back(report.contact.force_N);
  }
  for (const auto& body : simulation.bodies()) {
    state.x_m.push_back(body->positions_m(devices.context(0)));
    state.v_m_s.push_back(body->velocities_m_s(devices.context(0)));
  }
  state.monitors = simulation.monitors();
  state.liquid_m = simulation.snapshot().liquid_m;
  for (const StrokeResult& s : simulation.stroke_results())
    state.cuts.push_back({s.score.area_m2, s.score.due_m3, s.score.bled_m3, s.skin_length_m});
  StateArchive a;
  simulation.archive(a, nullptr);
  file = a.bytes();
  return state;
}

class CheckpointOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(CheckpointOnDevices);

TEST_P(CheckpointOnDevices, TenAndTenFramesAreTwenty) {
  const Scene scene = all_scene();
  std::string file;
  State whole = play(GetParam(), scene, 0, 20, file);
  const State first = play(GetParam(), scene, 0, 10, file), second = play(GetParam(), scene, 10, 20, file);
  EXPECT_NE(first.x_m, second.x_m);
  EXPECT_GT(length(second.force_N.back()), 0.1F);
  for (auto list : {&State::force_N}) (whole.*list).erase((whole.*list).begin(), (whole.*list).begin() + 10);
  whole.substeps.erase(whole.substeps.begin(), whole.substeps.begin() + 10);
  EXPECT_EQ(whole.force_N, second.force_N);
  EXPECT_EQ(whole.substeps, second.substeps);
  EXPECT_EQ(whole.x_m, second.x_m);
  EXPECT_EQ(whole.v_m_s, second.v_m_s);
  EXPECT_EQ(whole.monitors, second.monitors);
}

TEST(Checkpoint, OtherScenesAndDevicesAreNamed) {
  const Scene scene = all_scene();
  std::string file;
  play("cpu", scene, 0, 1, file);
  const auto message = [&](const std::string& devices, const Scene& other) {
    std::string copy = file;
    return test::message_of([&] { play(devices, other, 1, 2, copy); }, ErrorKind::usage);
  };
  EXPECT_EQ(message("cpu:2", scene),
            "f: the checkpoint was made on other devices than cpu:2: go on with the same '--devices'");
  Scene other = scene;
  other.bodies[1].name = "brick";
  EXPECT_EQ(message("cpu", other),
            "f: the state is of a scene with other 'bodies', or this one was edited since");
}

/// Two viscoelastic blocks in a stack, the upper one held at its top. A blade cuts both, one after the other;
/// parts lie on each other.
Scene cut_scene() {
  Scene scene;
  scene.reconstruction.resolution = 16;
  BodyDescription low;
  low.name = "low";
  low.cuttable = true;
  low.cut_capacity = 400;
  low.shape.size_m = {0.3, 0.15, 0.3};
  low.placement.position_m = {0, -0.3, 0};
  low.spacing_m = 0.05;
  low.material.model = TissueModel::tled;
  low.material.relaxation = {{0.4, 0.1}};
  BodyDescription high = low;
  high.name = "high";
  high.placement.position_m = {0.02, -0.149, 0};
  scene.bodies = {low, high};
  FixedRegion bottom;
  bottom.where.kind = RegionKind::half_space;
  bottom.where.frame = CoordinateFrame::world;
  bottom.where.point_m = {0, -0.36, 0};
  bottom.where.normal = {0, 1, 0};
  scene.bodies[0].fixed.push_back(bottom);
  BladeDescription blade;
  blade.name = "slicer";
  blade.from_m = {-0.2, -0.16, -0.3};
  blade.to_m = {-0.2, -0.14, 0.3};
  blade.path = {{0.05, {}, 0}, {0.5, {0.5, -0.3, 0}, 0}};
  scene.blades = {blade};
  return scene;
}

/// The state is written in the middle of a stroke: strips so far are cut once more, and the next ones find
/// the same nodes.
TEST_P(CheckpointOnDevices, AStrokeGoesOn) {
  const Scene scene = cut_scene();
  std::string file;
  const State whole = play(GetParam(), scene, 0, 20, file);
  std::string other = file;
  play(GetParam(), scene, 0, 10, file);
  const State second = play(GetParam(), scene, 10, 20, file);
  EXPECT_EQ(whole.x_m, second.x_m);
  EXPECT_EQ(whole.v_m_s, second.v_m_s);
  EXPECT_EQ(whole.monitors, second.monitors);
  const State third = play(GetParam(), scene, 20, 24, file), as_well = play(GetParam(), scene, 20, 24, other);
  EXPECT_EQ(third.x_m, as_well.x_m) << "all that is kept is the same, too";
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  if (GetParam() != "cpu") return;
  StateArchive a(file, "f");
  const FrameSet& seen = frame_of(23);
  simulation.archive(a, &seen);
  ASSERT_EQ(simulation.cuts().size(), 2U);
  EXPECT_NE(simulation.cuts()[0].body, simulation.cuts()[1].body);
  for (const auto& body : simulation.bodies())
    EXPECT_GT(body->cuts()->state(simulation.context()).copies, 20) << body->name();
}

/// A blade along a plane of nodes moves those off its way. They stay there for a run that goes on, in the
/// middle of the stroke and in the next one.
TEST_P(CheckpointOnDevices, NodesThatAStrokeMovedOffStayThere) {
  Scene scene = cut_scene();
  scene.gravity_m_s2 = {0, 0, 0};
  scene.bodies.resize(1);
  scene.bodies[0].fixed[0].where.point_m = {0, -0.32, 0};
  BladeDescription& blade = scene.blades[0];
  blade.from_m = {-0.25, -0.275, -0.3};
  blade.to_m = {-0.25, -0.275, 0.3};
  blade.path = {{0.05, {}, 0}, {0.3, {0.5, 0, 0}, 0}, {0.35, {0.5, 0.001, 0}, 0}, {0.6, {0, 0.001, 0}, 0}};
  std::string file;
  const State whole = play(GetParam(), scene, 0, 20, file);
  ASSERT_NE(file.find("nodes that are kept off blades"), std::string::npos);
  for (const int middle : {5, 12}) {
    std::string part;
    play(GetParam(), scene, 0, middle, part);
    const State second = play(GetParam(), scene, middle, 20, part);
    EXPECT_TRUE(whole.x_m == second.x_m) << middle;
    EXPECT_TRUE(whole.v_m_s == second.v_m_s) << middle;
    std::string other = file;
    const State third = play(GetParam(), scene, 20, 24, other),
                as_well = play(GetParam(), scene, 20, 24, part);
    EXPECT_TRUE(third.x_m == as_well.x_m) << middle << ": all that is kept is the same, too";
  }
}

/// Two strokes cut a plug out of a slab, which bleeds into a box; a vessel flows onto it.
Scene bleeding_scene() {
  Scene scene = cut_scene();
  scene.contact.cut_walls = false;
  BodyDescription& slab = scene.bodies[0];
  slab.name = "slab";
  slab.shape.size_m = {0.4, 0.1, 0.2};
  slab.placement.position_m = {0, -0.2, 0};
  slab.material.young_modulus_pa = 200000;
  slab.bleeding = BleedingDescription{0.05, 0.5, {}};
  FixedRegion end = slab.fixed[0];
  slab.fixed.clear();
  for (const double side : {-1.0, 1.0}) {
    end.where.point_m = {0.16 * side, 0, 0};
    end.where.normal = {-side, 0, 0};
    slab.fixed.push_back(end);
  }
  scene.bodies.resize(1);
  BladeDescription& left = scene.blades[0];
  left.from_m = {-0.072, 0, -0.3};
  left.to_m = {-0.072, 0, 0.3};
  left.path = {{0.05, {}, 0}, {0.35, {0, -0.3, 0}, 0}};
  BladeDescription right = left;
  right.name = "second";
  right.from_m.x = right.to_m.x = 0.074;
  scene.blades.push_back(right);
  LiquidDescription& blood = scene.fluid.emplace();
  blood.spacing_m = 0.02;
  blood.box = {{-0.3, -0.6, -0.2}, {0.3, 0.2, 0.2}};
  blood.max_particles = 3000;
  blood.max_speed_m_s = 3;
  blood.emitters.push_back({"vessel", {0.12, 0.1, 0}, {0, -1, 0}, 0.03, 0.5, 0.1, {}});
  return scene;
}

/// What wounds have as deficit, where they look for capacity, and the slots of the liquid go on, too.
TEST_P(CheckpointOnDevices, ABleedingStrokeGoesOn) {
  const Scene scene = bleeding_scene();
  std::string file;
  const State whole = play(GetParam(), scene, 0, 14, file);
  std::string other = file;
  play(GetParam(), scene, 0, 9, file);
  const State second = play(GetParam(), scene, 9, 14, file);
  EXPECT_TRUE(whole.x_m == second.x_m);
  EXPECT_TRUE(whole.liquid_m == second.liquid_m);
  EXPECT_EQ(whole.cuts, second.cuts);
  const State third = play(GetParam(), scene, 14, 15, file), as_well = play(GetParam(), scene, 14, 15, other);
  EXPECT_TRUE(third.liquid_m == as_well.liquid_m) << "all that is kept is the same, too";
  EXPECT_EQ(third.cuts, as_well.cuts);
  ASSERT_EQ(whole.cuts.size(), 2U);
  for (const auto& [area, due, bled, skin] : whole.cuts) {
    EXPECT_GT(bled, 0) << "particles came from it";
    EXPECT_GT(due, bled);
    EXPECT_GT(skin, 0.3);
  }
}

}  // namespace
}  // namespace tactus
