/// The score of a stroke, beside a line that was planned for it.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/blade_mesh.h"
#include "tactus/sim/body/body_cuts.h"

namespace tactus {
namespace {

/// A block of 0.2 x 0.2 x 0.1 m floats; a blade goes through it from left to right, 0.04 m below its middle.
/// The plan is on its front, 3 mm above the cut.
constexpr const char* kScene = R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
gravity_m_s2: [0, 0, 0]
bodies:
  - name: block
    contact: false
    cuttable: true
    cut_energy_j_m2: 100
    shape: {kind: box, size_m: [0.2, 0.2, 0.1]}
    placement: {position_m: [0, 0.6, 0.6]}
    spacing_m: 0.025
    material: {model: tled, young_modulus_pa: 30000, poisson_ratio: 0.4}
blades:
  - name: slicer
    from_m: [-0.15, 0.56, 0.5]
    to_m: [-0.15, 0.56, 0.7]
    path: [{time_s: 0.1}, {time_s: 0.5, displacement_m: [0.3, 0, 0]}]
plans:
  - {name: front, body: block, line: [{at: [-0.0999, -0.037, 0.05]}, {at: [0.0999, -0.037, 0.05]}]}
)";
constexpr double kSpacing_m = 0.025;

std::string with(const std::string& what, const std::string& instead) {
  std::string text = kScene;
  const std::size_t place = text.find(what);
  EXPECT_NE(place, std::string::npos) << what;
  return text.replace(place, what.size(), instead);
}

std::vector<StrokeResult> cut(const Scene& scene) {
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  for (int k = 0; k < 17; ++k) simulation.step(nullptr, 1.0 / 30);
  return simulation.stroke_results();
}

/// What pictures show of a scripted blade: closed steel that moves with its edge, and trails behind it.
TEST(ScriptedBlade, IsSteelBehindItsEdgeUntilItsPathEnds) {
  const Scene scene = parse_scene(with("displacement_m: [0.3, 0, 0]}]",
                                       "displacement_m: [0.3, 0, 0], angle_deg: 30}]\n    axis: [0, 0, 1]"),
                                  "scenes/x.yaml");
  const BladeDescription& blade = scene.blades.at(0);
  for (const double time_s : {0.0, 0.1, 0.3, 0.5}) {
    const TriangleMesh mesh = blade_mesh(blade, time_s);
    EXPECT_TRUE(topology(mesh).closed_manifold());
    // The profile, 0.03 m deep: a ground triangle of 0.3 and a plate of 0.7 of that, 0.06 of it thick; 0.2 m
    // long.
    EXPECT_NEAR(volume_m3(mesh), 0.2 * 0.03 * 0.03 * 0.06 * (0.5 * 0.3 + 0.7), 1e-8) << "turned outwards";
    const std::vector<Vec3f> edge_m = blade_edge_m(blade, time_s);
    for (const Vec3f end_m : edge_m) {
      const auto on = [&](Vec3f p) { return length(p - end_m) < 1e-6F; };
      EXPECT_EQ(std::count_if(mesh.positions_m.begin(), mesh.positions_m.end(), on), 1);
    }
    if (time_s ==
        0.3) {  // halfway it is turned by 15 degrees and goes along x: so does its back, the other way
      const Vec3f before = blade_edge_m(blade, 0.299)[0], way = normalized(edge_m[0] - before, {1, 0, 0});
      for (const Vec3f p : mesh.positions_m) EXPECT_LT(dot(p - edge_m[0], way), 0.001F);
    }
  }
  EXPECT_EQ(scripted_blades(scene, 0.5).size(), 1U);
  EXPECT_EQ(scripted_blades(scene, 0.501).size(), 0U);
}

/// The cut is a plane, and the body is at rest. So all lengths are known but for the rounding of floats, 1e-7
/// m, and the 2e-6 spacings by which cuts take the surface in. In a frame the blade goes 0.025 m: the first
/// and the last frame with a cut are known to that.
TEST(CutScore, APlaneCutHasTheLengthsOfTheBlock) {
  const std::vector<StrokeResult> results = cut(parse_scene(kScene, "scenes/x.yaml"));
  ASSERT_EQ(results.size(), 1U);
  const StrokeResult& r = results[0];
  constexpr double kRounding_m = 2e-6;
  EXPECT_NEAR(r.skin_length_m, 2 * (0.2 + 0.1), 100 * kRounding_m) << "some hundred pieces";
  EXPECT_NEAR(r.score.path_m, 0.2, kSpacing_m + kRounding_m);
  EXPECT_NEAR(r.score.depth_m, 0.05, kSpacing_m);
  EXPECT_EQ(r.score.slivers, 0);
  ASSERT_TRUE(r.deviation.has_value());
  EXPECT_EQ(r.plan, "front");
  EXPECT_NEAR(r.deviation->mean_m, 0.003, kRounding_m);
  EXPECT_NEAR(r.deviation->max_m, 0.003, kRounding_m);
  EXPECT_LT(r.deviation->beyond_m, 0.02) << "the plan ends in the first and last of 20 pieces";
  EXPECT_NEAR(r.deviation->followed_m, 0.1998, kRounding_m);
  // 100 J/m^2 over a front of 0.1 m.
  ASSERT_TRUE(r.peak_force_N.has_value());
  EXPECT_NEAR(*r.peak_force_N, 10, 0.25 * 10);
}

/// At x, the cut is 0.003 + 0.2 (x + 0.15) m below the plan, which is level, so that is how far it is off: on
/// average 0.033 m, at the right end 0.053 m. The plan ends 0.1 mm before the block does.
TEST(CutScore, AnObliqueCutLeavesThePlan) {
  Scene scene = parse_scene(with("displacement_m: [0.3, 0, 0]", "displacement_m: [0.3, -0.06, 0]"), "x.yaml");
  scene.plans[0].tolerance_m = 0.013;
  const std::vector<StrokeResult> results = cut(scene);
  ASSERT_EQ(results.size(), 1U);
  ASSERT_TRUE(results[0].deviation.has_value());
  const LineDeviation& d = *results[0].deviation;
  EXPECT_NEAR(d.mean_m, 0.033, 1e-4);
  EXPECT_NEAR(d.max_m, 0.053, 0.2 * 0.5 * 0.5 * kSpacing_m) << "of the middles of pieces";
  EXPECT_LT(d.followed_m, 0.02) << "the nearest of the cut is at its left end";
}

/// A wall that passes nodes by 0.004 spacings leaves slivers of as much fill in each of 8 x 4 cubes.
TEST(CutScore, SliversAreCounted) {
  Scene scene = parse_scene(kScene, "scenes/x.yaml");
  scene.blades[0].from_m.y = scene.blades[0].to_m.y = 0.5751;
  scene.plans.clear();
  const std::vector<StrokeResult> results = cut(scene);
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].score.slivers, 32);
  EXPECT_FALSE(results[0].deviation.has_value());
}

/// 2 steps of 1 cm and 1 cm^2, and one of twice the area: over four spacings of 0.5 cm, two steps.
TEST(CutScore, PeakForceIsTheLargestMeanOverAWay) {
  const std::vector<CutStep> steps{{0.05, 1}, {0.01, 1e-4}, {0.01, 1e-4}, {0.01, 2e-4}, {0.01, 1e-4}};
  EXPECT_NEAR(peak_cut_force_N(steps, 100, 0.005), 100 * 3e-4 / 0.02, 1e-12);
  EXPECT_NEAR(peak_cut_force_N({steps.data(), 1}, 100, 0.005), 100 * 1 / 0.05, 1e-9);
  EXPECT_EQ(peak_cut_force_N({}, 100, 0.005), 0);
}

/// Two crossing cuts give four parts with a surface each.
TEST(CutScore, CrossingCutsGiveFourParts) {
  const Scene scene = read_scene(TACTUS_SOURCE_DIR "/scenes/cross.yaml");
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  for (int k = 0; k < 20; ++k) simulation.step(nullptr, 1.0 / 30);
  const BodyCuts::State state = simulation.bodies()[0]->cuts()->state(simulation.context());
  EXPECT_EQ(state.parts, 4);
  EXPECT_EQ(state.closed_volumes_m3.size(), 4U);
  const std::vector<StrokeResult> results = simulation.stroke_results();
  ASSERT_EQ(results.size(), 2U);
  for (const StrokeResult& r : results) {
    EXPECT_EQ(r.plan, r.score.blade == "first" ? "along x" : "along z");
    // All round the block, and G times its height; blades are less than 2 degrees off its axes.
    EXPECT_NEAR(r.skin_length_m, 2 * (0.2 + 0.16), 0.01 * 0.72);
    EXPECT_NEAR(*r.peak_force_N, 164 * 0.16, 0.25 * 164 * 0.16);
  }
}

TEST(CutScore, RefusesPlansByName) {
  const auto expect = [](const std::string& what, const std::string& instead, const std::string& part) {
    const std::string text = with(what, instead);
    const std::string message = test::message_of(
        [&] {
          DeviceSet devices("cpu");
          test::FilmedWorld(devices, parse_scene(text, "scenes/x.yaml"), make_synthetic_rig(), {});
        },
        ErrorKind::usage);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  const std::string line = "line: [{at: [-0.0999, -0.037, 0.05]}, {at: [0.0999, -0.037, 0.05]}]";
  expect(
      line, "line: [{at: [-0.09, -0.037, 0.05]}, {at: [0.09, -0.037, 0.3]}]",
      "plan 'front': 'line[1].at' [0.09, -0.037, 0.3] misses body 'block': it is 0.25 m from its surface at "
      "rest, expected at most its spacing_m, 0.025; the nearest point of the surface is "
      "[0.09, -0.037, 0.05] (frame: body)");
  expect(line, "line: [{at: [-0.1, 0, 0]}, {at: [0.1, 0, 0]}]",
         "plan 'front': the way from 'line[0].at' to 'line[1].at', at [-0.0");
  expect(line, "frame: world, line: [{at: [0, 0, 0]}, {at: [0.1, 0, 0]}]", "(frame: world)");
  expect(line, "line: [{at: [0, 0, 0.05]}]", "'line' has 1 points, expected two or more");
  expect(line, "line: [{at: [0, 0, .nan]}]", "plans[0].line[0].at");
  expect(line, line + ", tolerance_m: 0", "tolerance_m");
  expect("body: block, line", "body: blok, line", "did you mean 'block'?");
  expect("    cuttable: true\n    cut_energy_j_m2: 100\n", "", "no 'cuttable: true'");
  expect("    cut_energy_j_m2: 100\n", "    cut_energy_j_m2: -1\n", "cut_energy_j_m2");
}

}  // namespace
}  // namespace tactus
