// A budget of frames: the controller without a clock, and the frames of a simulation that it changes.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "support/synthetic_frame.h"

namespace tactus {
namespace {

constexpr double kBudget_s = 0.011;

/// Frames whose time is that of their reductions times a load.
struct Plant {
  std::vector<double> frame_s{0.009, 0.0085, 0.005, 0.0042, 0.003};  ///< by reductions
  double noise = 0;
  FrameBudget budget{kBudget_s, 4};
  std::mt19937 random{1};
  std::size_t quality_reductions = 0;
  double now_s = 0, last_s = 0;
  std::vector<double> came_s;  ///< reductions that came after one had gone

  void step(double load, double period_s) {
    const double u = std::uniform_real_distribution<double>(-1, 1)(random);
    last_s = load * frame_s[quality_reductions] * (1 + noise * u);
    now_s += period_s;
    const std::size_t before = quality_reductions;
    quality_reductions = budget.next(last_s, now_s);
    if (quality_reductions > before && went_) came_s.push_back(now_s);
    if (quality_reductions != before) went_ = quality_reductions < before;
  }
  bool at_most_once_a_second() const {
    for (std::size_t k = 1; k < came_s.size(); ++k)
      if (came_s[k] - came_s[k - 1] < 1) return false;
    return true;
  }

 private:
  bool went_ = false;
};

TEST(FrameBudget, ThreeTimesTheLoadIsMetInTenFramesAndForgottenInSixty) {
  for (const double period_s : {1.0 / 90, 1.0 / 30}) {
    Plant plant;
    plant.noise = 0.05;
    for (int k = 0; k < 90; ++k) plant.step(1, period_s);
    EXPECT_EQ(plant.quality_reductions, 0U);
    for (int k = 0; k < 9; ++k) plant.step(3, period_s);
    for (int k = 9; k < 200; ++k) {
      plant.step(3, period_s);
      EXPECT_LE(plant.last_s, kBudget_s) << k;
    }
    for (int k = 0; k < 60; ++k) plant.step(1, period_s);
    EXPECT_EQ(plant.quality_reductions, 0U);
    for (int k = 0; k < 90; ++k) plant.step(1, period_s);
    EXPECT_EQ(plant.quality_reductions, 0U);
  }
}

/// One frame that takes long is no reason.
TEST(FrameBudget, OneSlowFrameChangesNothing) {
  Plant plant;
  for (int k = 0; k < 100; ++k) plant.step(k % 10 == 5 ? 4 : 1, 1.0 / 60);
  EXPECT_EQ(plant.quality_reductions, 0U);
  EXPECT_EQ(plant.budget.frames_above(), 10);
}

/// Loads that stay near where a reduction is just needed, that wander, and that jump to and fro
/// faster than that.
TEST(FrameBudget, ComesAndGoesAtMostOnceASecond) {
  std::size_t came = 0;
  for (int seed = 1; seed <= 40; ++seed) {
    Plant plant;
    plant.random.seed(static_cast<unsigned>(seed));
    plant.noise = 0.05 * (seed % 6);
    double load = 1;
    for (int k = 0; k < 20000; ++k) {
      const double u = std::uniform_real_distribution<double>(-1, 1)(plant.random);
      if (seed % 2 == 0)
        load = std::clamp(load * (1 + 0.02 * u), 0.3, 4.0);
      else
        load = k / (12 + seed) % 2 == 0 ? 0.9 + 0.01 * seed : 2.5;
      plant.step(load, 1.0 / 90);
    }
    EXPECT_TRUE(plant.at_most_once_a_second()) << "seed " << seed;
    came += plant.came_s.size();
  }
  EXPECT_GT(came, 100U);
}

/// What a reduction brought is what it would cost to give up: with little to gain, no trial and
/// error.
TEST(FrameBudget, ASteadyLoadIsNotTriedAgainAndAgain) {
  Plant plant;
  for (int k = 0; k < 6000; ++k) plant.step(1.6, 1.0 / 30);
  EXPECT_EQ(plant.quality_reductions, 2U);
  EXPECT_TRUE(plant.came_s.empty());
}

/// A ball comes down on a slab beside a liquid.
Scene scene_with_liquid() {
  Scene scene;
  scene.name = "slab";
  scene.reconstruction.resolution = 32;
  BodyDescription slab;
  slab.material.model = TissueModel::flsm;
  slab.material.half_width = 2;
  slab.name = "slab";
  slab.shape.size_m = {0.4, 0.1, 0.4};
  slab.placement.position_m = {0, 0.25, 0};
  slab.spacing_m = 0.05;
  SpaceRegion floor;
  floor.kind = RegionKind::half_space;
  floor.point_m = {0, -0.03, 0};
  slab.fixed.push_back({floor});
  scene.bodies.push_back(slab);
  scene.fluid.emplace();
  scene.fluid->spacing_m = 0.04;
  scene.fluid->box = {{-0.3, 0, -0.3}, {0.3, 0.6, 0.3}};
  scene.fluid->blocks.push_back({{{-0.3, 0, -0.3}, {0.3, 0.09, 0.3}}, {}});
  return scene;
}

/// Made once.
const FrameSet& ball_frame(int k) {
  static std::map<int, FrameSet> made;
  FrameSet& frame = made[std::min(k, 40)];
  if (!frame.silhouettes.empty()) return frame;
  SyntheticOptions options;
  options.figure = "sphere";
  options.shape.scale = 0.6F;
  // From a gap of 1 cm above the slab's 0.3 m to 3 cm below in 40 frames.
  options.shape.offset_m = {0, 0.31F - 0.001F * static_cast<float>(std::min(k, 40)) + 0.15F - 0.5F, 0};
  options.depth = options.truth = false;
  SyntheticSource source(options);
  EXPECT_EQ(source.next(frame), NextFrame::success);
  return frame;
}

struct Saved {
  std::vector<Index> vertices;
  std::vector<std::size_t> made;
  std::vector<Vec3f> state;
  int recordings = 0;
};

/// Frames whose cost is told from what they did, so that nothing hangs on the machine: 10 us a
/// vertex, three times as much in frames 15 to 29.
Saved run(const std::string& devices_text) {
  DeviceSet devices(devices_text, 3);
  test::FilmedWorld simulation(devices, scene_with_liquid(), make_synthetic_rig(), {}, true);
  const std::vector<QualityReduction> ladder = simulation.quality_reductions();
  EXPECT_EQ(ladder, (std::vector<QualityReduction>{QualityReduction::hull, QualityReduction::liquid,
                                                   QualityReduction::samples}));
  double base_s = 0;
  std::optional<FrameBudget> budget;
  Saved out;
  std::size_t made = 0;
  for (int k = 0; k < 70; ++k) {
    const FrameSet& frame = ball_frame(k);
    const StepReport report = simulation.step(&frame, k == 0 ? 0 : 1.0 / 60);
    EXPECT_EQ(text_of(report.notices), "") << "frame " << k;
    out.vertices.push_back(report.hull.vertices);
    out.made.push_back(made);
    const double cost_s = 1e-5 * report.hull.vertices * (k >= 15 && k < 30 ? 3 : 1);
    if (k == 0) base_s = cost_s;
    if (k == 0) budget.emplace(1.3 * base_s, ladder.size());
    made = budget->next(cost_s, k / 60.0);
    simulation.reduce_quality(std::span(ladder).first(made));
  }
  const FrameSnapshot end = simulation.snapshot();
  out.state = end.bodies.at(0).positions_m;
  out.state.insert(out.state.end(), end.real.positions_m.begin(), end.real.positions_m.end());
  out.state.insert(out.state.end(), end.liquid_m.begin(), end.liquid_m.end());
  out.recordings = simulation.schedule().recordings();
  return out;
}

class SavingsOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(SavingsOnDevices);

/// A hull of half the resolution has a quarter of the vertices, to what its contours add; the ball stays in
/// contact, and everything returns.
TEST_P(SavingsOnDevices, GiveWayAndComeBackWithTheSameBitsEverywhere) {
  static const Saved on_cpu = run("cpu");
  const Saved got = run(GetParam());
  EXPECT_EQ(got.vertices, on_cpu.vertices);
  EXPECT_EQ(got.made, on_cpu.made);
  EXPECT_EQ(got.state, on_cpu.state);
  EXPECT_EQ(got.made[15], 0U);
  EXPECT_GT(got.made[25], 0U);
  EXPECT_EQ(got.made[69], 0U);
  for (std::size_t k = 25; k < 30; ++k)
    EXPECT_NEAR(got.vertices[k], got.vertices[10] / 4.0, got.vertices[10] / 10.0);
  EXPECT_NEAR(got.vertices[69], got.vertices[10], got.vertices[10] / 50.0);
  EXPECT_EQ(got.recordings, 1 + static_cast<int>(*std::max_element(got.made.begin(), got.made.end())));
}

/// Savings change what is computed, not what is true: the slab is pressed as deep with all of them.
TEST(Savings, ThePressedSlabIsTheSameToAVoxel) {
  std::vector<Vec3f> seen[2];
  for (const bool all : {false, true}) {
    DeviceSet devices("cpu");
    test::FilmedWorld simulation(devices, scene_with_liquid(), make_synthetic_rig(), {}, true);
    if (all) simulation.reduce_quality(simulation.quality_reductions());
    for (int k = 0; k < 50; ++k) simulation.step(ball_frame(k), k == 0 ? 0 : 1.0 / 60);
    seen[all ? 1 : 0] = simulation.snapshot().bodies.at(0).positions_m;
    EXPECT_EQ(simulation.liquid()->liquid().settings().iterations, all ? 3 : 4) << "half, but at least three";
  }
  ASSERT_EQ(seen[0].size(), seen[1].size());
  double largest = 0, pressed = 0;
  for (std::size_t i = 0; i < seen[0].size(); ++i) {
    largest = std::max(largest, static_cast<double>(length(seen[0][i] - seen[1][i])));
    pressed = std::max(pressed, 0.3 - static_cast<double>(seen[0][i].y));
  }
  EXPECT_GT(pressed, 0.02);
  // Vertices lie on contours at both resolutions. Triangles have sides of up to 1.42 voxels of 6.25 cm, and
  // so a circumradius of up to 5.1 cm: in a ball of 15 cm, their middles lie up to 9 mm deep.
  EXPECT_LT(largest, 0.009);
}

}  // namespace
}  // namespace tactus
