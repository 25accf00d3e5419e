/// Walls of incisions and parts of cut bodies that touch each other, and other bodies.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <set>

#include "support/filmed_world.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/body/body_cuts.h"

namespace tactus {
namespace {

/// A block of 8 x 8 x 8 cubes between y = 0.5 and 0.7 m, and a blade that goes through it at y = 0.604 m.
constexpr const char* kBlock = R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
bodies:
  - name: block
    cuttable: true
    cut_capacity: 600
    shape: {kind: box, size_m: [0.2, 0.2, 0.2]}
    placement: {position_m: [0, 0.6, 0.6]}
    spacing_m: 0.025
    material: {model: tled, young_modulus_pa: 20000, poisson_ratio: 0.3, damping: 0.5}
    FIXED
blades:
  - name: slicer
    from_m: [-0.15, 0.604, 0.45]
    to_m: [-0.15, 0.604, 0.75]
    path: [{time_s: 0.1}, {time_s: 0.4, displacement_m: [WAY, 0, 0]}]
)";
constexpr const char* kOnFloor = "fixed: [{kind: half_space, point_m: [0, -0.09, 0], normal: [0, 1, 0]}]";
constexpr const char* kHanging = "fixed: [{kind: half_space, point_m: [0, 0.09, 0], normal: [0, -1, 0]}]";
constexpr double kSpacing_m = 0.025;

std::string block(const char* fixed, const char* way) {
  std::string text = kBlock;
  text.replace(text.find("FIXED"), 5, fixed);
  text.replace(text.find("WAY"), 3, way);
  return text;
}

struct Played {
  std::vector<Vec3f> x_m;
  BodyCuts::State state;
  /// Of pairs of points of both walls that coincide at rest: how far the upper one is above the lower one,
  /// and how far they are apart sideways [spacings].
  double widest = -1e9, narrowest = 1e9, mean = 0, sideways = 0;
  int pairs = 0;
};

void see_gaps(const test::FilmedWorld& simulation, Played& played) {
  const SoftBody& body = *simulation.bodies()[0];
  const TriangleMesh rest = body.cuts()->cutter().mesh(
                         body.cuts()->cutter().lattice().lattice().rest_positions_m()),
                     now = body.cuts()->cutter().mesh(played.x_m);
  const cut::CutSurface& surface = body.cuts()->cutter().surface();
  std::map<std::array<float, 3>, std::set<std::size_t>> at;
  std::vector<Vec3f> normal(rest.positions_m.size());
  for (Index t = 0; t < surface.triangle_count(); ++t) {
    if (!surface.is_wall(t)) continue;
    const auto& vertices = surface.triangles()[static_cast<std::size_t>(t)];
    const auto p = [&](std::size_t k) { return rest.positions_m[static_cast<std::size_t>(vertices[k])]; };
    const Vec3f n = cross(p(1) - p(0), p(2) - p(0));
    for (std::size_t k = 0; k < 3; ++k) {
      normal[static_cast<std::size_t>(vertices[k])] += n;
      at[{p(k).x, p(k).y, p(k).z}].insert(static_cast<std::size_t>(vertices[k]));
    }
  }
  for (const auto& [place, vertices] : at) {
    // The normals of slivers are rounding.
    if (vertices.size() != 2 || !(std::abs(normal[*vertices.begin()].y) > 1e-3F * sqr(kSpacing_m))) continue;
    const bool first_is_upper = normal[*vertices.begin()].y < 0;
    const Vec3f upper = now.positions_m[first_is_upper ? *vertices.begin() : *vertices.rbegin()],
                lower = now.positions_m[first_is_upper ? *vertices.rbegin() : *vertices.begin()];
    const double gap = double{upper.y - lower.y} / kSpacing_m;
    played.widest = std::max(played.widest, gap);
    played.narrowest = std::min(played.narrowest, gap);
    played.sideways = std::max(played.sideways,
                               double{length(Vec3f{upper.x - lower.x, 0, upper.z - lower.z})} / kSpacing_m);
    played.mean += gap;
    ++played.pairs;
  }
  played.mean /= std::max(played.pairs, 1);
}

Played play(const std::string& text, const char* devices_text, int frames) {
  const Scene scene = parse_scene(text, "scenes/x.yaml");
  DeviceSet devices(devices_text, 3);
  SyntheticOptions options;
  options.figure = "sphere";
  options.depth = options.truth = false;
  SyntheticSource source(options);
  test::FilmedWorld simulation(devices, scene, source.rig(), {});
  for (int k = 0; k < frames; ++k) simulation.step(nullptr, 1.0 / 30);
  Played played;
  played.x_m = simulation.bodies()[0]->positions_m(simulation.context());
  played.state = simulation.bodies()[0]->cuts()->state(simulation.context());
  see_gaps(simulation, played);
  std::printf("%d pairs, gap %.4f .. %.4f, mean %.4f, sideways %.4f spacings\n", played.pairs,
              played.narrowest, played.widest, played.mean, played.sideways);
  return played;
}

/// Friction and contact hold what lies: without `cut_walls` the upper part falls through the lower one by 460
/// spacings. The bar is 0.1 spacings; a blade that is straight leaves 0.01 of rounding and sagging.
TEST(CutContact, ASeveredPartLiesOnTheOther) {
  const Played played = play(block(kOnFloor, "0.3"), "cpu", 60);
  EXPECT_EQ(played.state.parts, 2);
  EXPECT_GT(played.pairs, 50);
  EXPECT_GT(played.narrowest, -0.1);
  EXPECT_LT(played.widest, 0.1);
  EXPECT_LT(played.sideways, 0.1);
  for (const char* devices : {"cpu:2", "cpu:3"})
    EXPECT_TRUE(played.x_m == play(block(kOnFloor, "0.3"), devices, 60).x_m) << devices;
}

/// Places that no cut has used take no part: ten times as many leave each bit as it was.
TEST(CutContact, CapacityChangesNothing) {
  const std::string few = block(kOnFloor, "0.3");
  std::string many = few;
  many.replace(many.find("cut_capacity: 600"), 17, "cut_capacity: 6000");
  const std::vector<Vec3f> x_m = play(few, "cpu", 20).x_m;
  for (const char* devices : {"cpu", "cpu:3"}) {
    std::vector<Vec3f> of_many = play(many, devices, 20).x_m;
    ASSERT_EQ(of_many.size() - x_m.size(), 2U * 5400U);
    of_many.resize(x_m.size());
    EXPECT_TRUE(of_many == x_m) << devices;
  }
}

TEST(CutContact, ASlitUnderPressureStaysShut) {
  const Played played = play(block(kOnFloor, "0.19"), "cpu", 60);
  EXPECT_EQ(played.state.parts, 1);
  EXPECT_GT(played.pairs, 50);
  EXPECT_GT(played.narrowest, -0.1);
  EXPECT_LT(played.widest, 0.1);
}

TEST(CutContact, WhatIsShutStaysShutFor60Seconds) {
  if (std::getenv("TACTUS_LONG_TESTS") == nullptr) GTEST_SKIP() << "60 s of scenes: set TACTUS_LONG_TESTS=1";
  for (const char* way : {"0.19", "0.3"}) {
    const Played played = play(block(kOnFloor, way), "cpu", 60 * 30);
    EXPECT_GT(played.pairs, 50);
    EXPECT_GT(played.narrowest, -0.1) << way;
    EXPECT_LT(played.sideways, 0.1) << way;
  }
}

/// Walls that are drawn apart feel nothing of each other, so the slit opens as far as without contact. What
/// contact did while the blade was on its way has faded after 2 s: 1e-3 of the gape.
TEST(CutContact, ASlitUnderTensionGapes) {
  const Played played = play(block(kHanging, "0.13"), "cpu", 60),
               alone = play(block(kHanging, "0.13") + "contact: {cut_walls: false}\n", "cpu", 60);
  EXPECT_EQ(played.state.parts, 1);
  EXPECT_GT(played.widest, 1);
  EXPECT_GT(played.narrowest, -0.1);
  EXPECT_NEAR(played.widest, alone.widest, 1e-3 * alone.widest);
}

/// A part that lies on another body.
struct Lying {
  double force_N = 0, mass_kg = 0, depth_m = 0, step_s = 0;
  float lowest_m = 1;  ///< of what was cut off
};

/// @param substeps of a frame; 0: automatic
Lying lie_on_a_pad(int substeps) {
  const std::string text = block(kHanging, "0.3") + R"(
obstacles:
  - {name: table, kind: plane, placement: {position_m: [0, 0.36, 0]}}
)";
  Scene scene = parse_scene(text, "scenes/x.yaml");
  if (substeps > 0) scene.frame.substeps = substeps;
  BodyDescription pad = scene.bodies[0];
  pad.name = "pad";
  pad.cuttable = false;
  pad.cut_capacity = {};
  pad.fixed.clear();
  pad.shape.size_m = {0.3, 0.08, 0.3};
  pad.placement.position_m = {0, 0.405, 0.6};
  scene.bodies.push_back(pad);
  DeviceSet devices("cpu");
  SyntheticOptions options;
  options.figure = "sphere";
  options.depth = options.truth = false;
  SyntheticSource source(options);
  test::FilmedWorld simulation(devices, scene, source.rig(), {});
  Lying found;
  for (int k = 0; k < 120; ++k) {
    const StepReport report = simulation.step(nullptr, 1.0 / 30);
    for (const BodyContact& touch : report.contacts) {
      if (touch.body != "block" || touch.component != "pad" || k < 110) continue;
      found.force_N -= double{touch.reaction.force_N.y} / 10;
      found.depth_m = std::max(found.depth_m, double{touch.reaction.max_depth_m});
      found.step_s = std::max(found.step_s, 1.0 / 30 / report.substeps);
    }
  }
  const SoftBody& block = *simulation.bodies()[0];
  const std::vector<Vec3f> x_m = block.positions_m(simulation.context());
  for (std::size_t i = 0; i < x_m.size(); ++i) {
    const float m = block.cuts()->cutter().lattice().lattice().node_mass_kg[i];
    if (m == 0 || x_m[i].y > 0.57F) continue;
    found.mass_kg += double{m};
    found.lowest_m = std::min(found.lowest_m, x_m[i].y);
  }
  return found;
}

/// A cuttable cube comes to rest on a box before the first frame, with contact in every 4th substep: so the
/// pieces of settling are 4 substeps, in which fast modes turn round. Stops that took the mean velocity of a
/// piece fed these modes, until the cube blew up (5 J). At rest it has 1.5e-3 J of strain; it moves with less
/// than a hundredth of that.
TEST(CutContact, ACubeSettlesWithContactInEveryFourthSubstep) {
  const Scene scene = parse_scene(R"(
source: {kind: none}
frame: {start: settled}
contact: {every: 4}
bodies:
  - name: cube
    cuttable: true
    shape: {kind: box, size_m: [0.1, 0.1, 0.1]}
    placement: {position_m: [0, 0.05, 0]}
    spacing_m: 0.02
    material: {model: tled, young_modulus_pa: 100000}
obstacles:
  - {name: floor, kind: box, size_m: [2, 0.2, 2], placement: {position_m: [0, -0.1, 0]}}
)",
                                  "scenes/x.yaml");
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  for (int k = 0; k < 3; ++k) {
    for (const Notice& n : simulation.step(nullptr, k == 0 ? 0 : 1.0 / 30).notices)
      ADD_FAILURE() << "frame " << k << ": " << n.message();
    EXPECT_LT(simulation.bodies()[0]->status().motion.kinetic_J, 1.5e-5) << "frame " << k;
  }
}

/// Four strokes that overlap in time cut a liver while it falls onto a floor: all parts stay as they are
/// strained. Corners lighter than an eighth of a cube were thrown by pushes of contact: it blew up in
/// frame 8.
TEST(CutContact, AFallingLiverBearsFourStrokes) {
  const Scene scene = parse_scene(R"(
source: {kind: none}
bodies:
  - name: liver
    cuttable: true
    shape: {kind: figure, figure: liver}
    spacing_m: 0.025
    material: {model: tled, young_modulus_pa: 20000}
obstacles:
  - {name: floor, kind: plane, placement: {position_m: [0, 0.34, 0]}}
blades:
  - {name: a, from_m: [-0.272, 0.4116, -0.1076], to_m: [0.1388, 0.3417, -0.2215], path: [{time_s: 0.0667}, {time_s: 0.1667, displacement_m: [0.1324, 0.2606, 0.3181]}]}
  - {name: b, from_m: [-0.2898, 0.5145, -0.1091], to_m: [-0.0302, 0.794, 0.0937], path: [{time_s: 0.1}, {time_s: 0.2, displacement_m: [0.2662, -0.3236, 0.1052]}]}
  - {name: c, from_m: [0.2485, 0.4122, 0.1545], to_m: [-0.041, 0.73, 0.1968], path: [{time_s: 0.1333}, {time_s: 0.2333, displacement_m: [-0.21, -0.1449, -0.3486]}]}
  - {name: d, from_m: [0.1169, 0.297, -0.2047], to_m: [0.2511, 0.6769, -0.049], path: [{time_s: 0.1667}, {time_s: 0.2667, displacement_m: [-0.2883, -0.0294, 0.3204]}]}
)",
                                  "scenes/x.yaml");
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  for (int k = 0; k < 14; ++k)
    for (const Notice& n : simulation.step(nullptr, k == 0 ? 0 : 1.0 / 30).notices)
      EXPECT_NE(n.code, "body.blew_up") << "frame " << k << ": " << n.message();
  EXPECT_FALSE(simulation.bodies()[0]->status().is_frozen);
  EXPECT_GT(simulation.bodies()[0]->cuts()->cutter().lattice().copies_in_use(), 100);
}

/// What a blade cuts off a hanging block falls onto another soft body, and lies there with its weight.
///
/// Each substep takes away all of a point's depth, so a point is as deep as its force drives both sides into
/// one another in a step: depth = F dt^2 (1 / m + 1 / n) for nodes of masses m and n on the sides. In the
/// mean over the block's lower face, of 64 cubes, F is the weight and m half a layer. The pad is 3.2 cubes
/// high and free, so its upper nodes have 0.167 of a cube (mass_points.h). Nowhere is the pressure more than
/// under the corner of a stiff square punch. Along one axis that has 1 / (pi sqrt(1 - x^2)) of its force at
/// x; the last half of 8 cubes has 0.161 of it, 2.57 times its share; a corner 2.57^2 = 6.6 times.
/// Measured: 2.4 with the automatic substeps, which smooth the pressure, 3.6 with 36.
TEST(CutContact, APartLiesOnAnotherBody) {
  for (const int substeps : {0, 36}) {
    const Lying lying = lie_on_a_pad(substeps);
    EXPECT_GT(lying.mass_kg, 1);
    EXPECT_GT(lying.lowest_m, 0.40F);
    // Over frames in which it lies still, impulses are its weight; what still swings is the tolerance.
    EXPECT_NEAR(lying.force_N, 9.81 * lying.mass_kg, 0.02 * 9.81 * lying.mass_kg);
    const double layer_kg = 64 * 1000 * std::pow(kSpacing_m, 3),
                 mean_m = lying.force_N * sqr(lying.step_s) * (1 / 0.5 + 1 / 0.167) / layer_kg;
    std::printf("%d substeps: %.2f times the mean\n", substeps, lying.depth_m / mean_m);
    EXPECT_GT(lying.depth_m, mean_m) << substeps;
    EXPECT_LT(lying.depth_m, sqr(2.57) * mean_m) << substeps;
  }
}

}  // namespace
}  // namespace tactus
