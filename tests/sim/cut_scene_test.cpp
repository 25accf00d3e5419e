/// Bodies of a scene that blades cut.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <set>
#include <string>
#include <utility>

#include "support/data_folder.h"
#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "support/probe_readings.h"
#include "support/sliced_block.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {
namespace {

/// Probes lie above and below the blade.
std::string scene_text() {
  return std::string(kSlicedBlock) + R"(
probes:
  - {name: above, body: block, position_m: [0, 0.05, 0]}
  - {name: below, body: block, position_m: [0, -0.08, 0]}
)";
}

struct Played {
  std::vector<Vec3f> probes;
  BodyCuts::State state;
  std::vector<CutScore> cuts;
  std::vector<Notice> notices;
};

Played play(const Scene& scene, const char* devices_text) {
  DeviceSet devices(devices_text, 3);
  SyntheticOptions options;
  options.figure = "sphere";
  options.depth = options.truth = false;
  SyntheticSource source(options);
  test::FilmedWorld simulation(devices, scene, source.rig(), {});
  Played played;
  for (int k = 0; k < 24; ++k) {
    const StepReport report = simulation.step(nullptr, 1.0 / 30);
    played.notices.insert(played.notices.end(), report.notices.begin(), report.notices.end());
  }
  played.probes = probe_positions_m(simulation);
  played.state = simulation.bodies()[0]->cuts()->state(simulation.context());
  played.cuts = simulation.cuts();
  return played;
}

/// The lower part falls from when it is severed, about 0.4 s, and its probe with it; the upper one stays. The
/// incision has the area of the block's section.
TEST(CutScene, ABladeSeversABlock) {
  const Scene scene = parse_scene(scene_text(), "scenes/x.yaml");
  const Played played = play(scene, "cpu");
  EXPECT_EQ(played.state.parts, 2);
  ASSERT_EQ(played.state.closed_volumes_m3.size(), 2U);
  EXPECT_NEAR(played.probes[0].y, 0.65, 0.01);
  EXPECT_LT(played.probes[1].y, 0.4F);
  ASSERT_EQ(played.cuts.size(), 1U);
  EXPECT_EQ(played.cuts[0].blade, "slicer");
  EXPECT_NEAR(played.cuts[0].area_m2, 0.2 * 0.1, 0.1 * 0.2 * 0.1);
  EXPECT_NEAR(played.cuts[0].depth_m, 0.05, 0.006);
  const Played again = play(scene, "cpu:3");
  EXPECT_TRUE(played.probes == again.probes);
  EXPECT_EQ(played.state.closed_volumes_m3, again.state.closed_volumes_m3);
}

/// A blade that passes over the block is told once, at the end of its path; one that cuts isn't.
TEST(CutScene, ABladeThatMissesIsTold) {
  Scene scene = parse_scene(scene_text(), "scenes/x.yaml");
  EXPECT_TRUE(play(scene, "cpu").notices.empty());
  scene.blades[0].from_m.y = scene.blades[0].to_m.y = 0.8;
  const Played played = play(scene, "cpu");
  ASSERT_EQ(played.notices.size(), 1U);
  EXPECT_EQ(played.notices[0].code, "cut.missed");
  EXPECT_EQ(played.notices[0].text, "blade 'slicer' is at the end of its path and has cut nothing");
  EXPECT_EQ(played.state.copies, 0);
}

/// Places for nodes of cuts that no cube has yet are none of the body: 9 x 9 x 5 nodes before the cut; after
/// it, those of its section once more, each where a cube is.
TEST(CutScene, ItsNodesAreThoseInUse) {
  const Scene scene = parse_scene(scene_text(), "scenes/x.yaml");
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  EXPECT_EQ(simulation.nodes("block").positions_m.size(), 405U);
  for (int k = 0; k < 20; ++k) simulation.step(nullptr, 1.0 / 30);
  const std::vector<Vec3f> x_m = simulation.nodes("block").positions_m;
  const CubeLattice& lattice = simulation.bodies()[0]->shape().lattice;
  std::set<Index> of_cubes;
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c)
    if (lattice.has_cube(c)) of_cubes.insert(lattice.cube_nodes[c].begin(), lattice.cube_nodes[c].end());
  EXPECT_GE(x_m.size(), 405U + 9 * 5);
  EXPECT_EQ(static_cast<std::size_t>(*of_cubes.rbegin()), x_m.size() - 1);
  EXPECT_EQ(of_cubes.size(), x_m.size());
}

/// A block of 10^3 cubes away from the origin, and a blade that takes 9 frames through it.
std::string block_text(const char* blade, const char* material, const char* more) {
  return std::string(R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
bodies:
  - name: block
    cuttable: true
    contact: false
    shape: {kind: box, size_m: [0.1, 0.1, 0.1]}
    placement: {position_m: [0, 0.5, 0]}
    spacing_m: 0.01
    material: {model: tled, poisson_ratio: 0.4, damping: 0.3, young_modulus_pa: )") +
         material + "}\n" + more + "blades:\n  - name: slicer\n    " + blade;
}

/// Along a plane of nodes, in the middle of a block that nothing moves: the halves are equal, and stay where
/// they are.
TEST(IndependentCutScene, ABladeAlongAPlaneOfNodes) {
  Scene scene = parse_scene(block_text("from_m: [-0.07, 0.5, -0.1]\n    to_m: [-0.07, 0.5, 0.1]\n    path: "
                                       "[{time_s: 0.1}, {time_s: 0.4, displacement_m: [0.14, 0, 0]}]\n",
                                       "8000", ""),
                            "scenes/x.yaml");
  scene.gravity_m_s2 = {};
  const Played played = play(scene, "cpu");
  EXPECT_EQ(played.state.parts, 2);
  ASSERT_EQ(played.state.closed_volumes_m3.size(), 2U);
  for (const double volume_m3 : played.state.closed_volumes_m3) EXPECT_NEAR(volume_m3, 5e-4, 2e-3 * 5e-4);
  ASSERT_EQ(played.cuts.size(), 1U);
  EXPECT_NEAR(played.cuts[0].area_m2, 0.01, 1e-4);
  const Played again = play(scene, "cpu:3");
  EXPECT_EQ(played.state.closed_volumes_m3, again.state.closed_volumes_m3);
  EXPECT_EQ(played.cuts[0].area_m2, again.cuts[0].area_m2);
}

/// A block that sags while it is cut, half a metre from the origin. The part that falls has a surface of its
/// own.
TEST(IndependentCutScene, PartsFarFromTheOriginHaveSurfacesOfTheirOwn) {
  Scene scene = parse_scene(
      block_text("from_m: [0.003, 0.3, -0.2]\n    to_m: [0.003, 0.7, -0.2]\n    path: [{time_s: 0.1}, "
                 "{time_s: 0.4, displacement_m: [0, 0, 0.4]}]\n",
                 "20000", "    fixed: [{kind: half_space, point_m: [-0.0475, 0, 0], normal: [1, 0, 0]}]\n"),
      "scenes/x.yaml");
  scene.gravity_m_s2 = {0, -3, 0};
  const Played played = play(scene, "cpu");
  EXPECT_EQ(played.state.parts, 2);
  ASSERT_EQ(played.state.closed_volumes_m3.size(), 2U);
  // It hangs by 3 mm at its end: what it is strained by doesn't change the volume by more than 0.5 %.
  std::vector<double> volumes_m3 = played.state.closed_volumes_m3;
  std::sort(volumes_m3.begin(), volumes_m3.end());
  EXPECT_NEAR(volumes_m3[0], 4.7e-4, 5e-3 * 4.7e-4);
  EXPECT_NEAR(volumes_m3[1], 5.3e-4, 5e-3 * 5.3e-4);
}

/// A block hangs from its top, over a table. A blade cuts its lower part off, which falls onto the table. A
/// second blade cuts it where it lies.
constexpr const char* kTray = R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
bodies:
  - name: block
    cuttable: true
    cut_capacity: 600
    shape: {kind: box, size_m: [0.2, 0.2, 0.1]}
    placement: {position_m: [0, 0.6, 0.6]}
    spacing_m: 0.025
    material: {model: tled, young_modulus_pa: 30000, poisson_ratio: 0.4, damping: 0.3}
    fixed: [{kind: half_space, point_m: [0, 0.09, 0], normal: [0, -1, 0]}]
obstacles:
  - {name: tray, kind: plane, placement: {position_m: [0, 0.45, 0]}}
blades:
  - name: slicer
    from_m: [-0.15, 0.56, 0.5]
    to_m: [-0.15, 0.56, 0.7]
    path: [{time_s: 0.1}, {time_s: 0.3, displacement_m: [0.3, 0, 0]}]
  - name: second
    from_m: [0.004, 0.52, 0.5]
    to_m: [0.004, 0.52, 0.7]
    path: [{time_s: 0.7}, {time_s: 0.8, displacement_m: [0, -0.1, 0]}]
probes:
  - {name: above, body: block, position_m: [0, 0.05, 0]}
  - {name: left, body: block, position_m: [-0.05, -0.08, 0]}
  - {name: right, body: block, position_m: [0.05, -0.08, 0]}
)";

constexpr float kTraySpacing_m = 0.025F;

/// Positions of the probes after each frame, and what the table was pressed with.
struct Fallen {
  std::vector<std::vector<Vec3f>> probes;
  std::vector<float> force_N;
  BodyCuts::State state;
  float lowest_m = 0, mass_kg = 0;  ///< of what fell
};

/// @param walls_touch else slabs of the body may be on several devices
Fallen fall(const char* devices_text, int frames, bool walls_touch = true) {
  Scene scene = parse_scene(kTray, "scenes/x.yaml");
  scene.contact.cut_walls = walls_touch;
  DeviceSet devices(devices_text, 3);
  SyntheticOptions options;
  options.figure = "sphere";
  options.depth = options.truth = false;
  SyntheticSource source(options);
  test::FilmedWorld simulation(devices, scene, source.rig(), {});
  Fallen fallen;
  for (int k = 0; k < frames; ++k) {
    const StepReport report = simulation.step(nullptr, 1.0 / 30);
    float force_N = 0;
    for (const BodyContact& touch : report.contacts) force_N += touch.reaction.force_N.y;
    fallen.force_N.push_back(force_N);
    fallen.probes.push_back(probe_positions_m(simulation));
  }
  fallen.state = simulation.bodies()[0]->cuts()->state(simulation.context());
  const CubeLattice& lattice = simulation.bodies()[0]->shape().lattice;
  const std::vector<Vec3f> x_m = simulation.bodies()[0]->positions_m(simulation.context());
  for (std::size_t i = 0; i < x_m.size(); ++i)
    if (lattice.node_mass_kg[i] > 0 && x_m[i].y < 0.54F) fallen.mass_kg += lattice.node_mass_kg[i];
  const TriangleMesh surface = simulation.bodies()[0]->surface().to_mesh(simulation.context());
  fallen.lowest_m = 1;
  for (const Vec3f& p : surface.positions_m) fallen.lowest_m = std::min(fallen.lowest_m, p.y);
  return fallen;
}

/// What lies still presses the table with its weight: impulses of contact change the momentum by what is
/// told, also where nodes are virtual. The mean over frames is within 1e-3 of it, as vibrations fade.
TEST(CutScene, SeveredPartsRestOnATableAndAreCutAgain) {
  const Fallen fallen = fall("cpu", 60);
  EXPECT_EQ(fallen.state.parts, 3);
  EXPECT_EQ(fallen.state.closed_volumes_m3.size(), 3U);
  const float mean_N = std::accumulate(fallen.force_N.end() - 10, fallen.force_N.end(), 0.F) / 10;
  EXPECT_NEAR(mean_N, -9.81F * fallen.mass_kg, 1e-3F * 9.81F * fallen.mass_kg);
  EXPECT_GT(fallen.mass_kg, 1.F);
  EXPECT_GT(fallen.lowest_m, 0.45F - 0.02F * kTraySpacing_m);
  for (const std::size_t probe : {1U, 2U}) {
    const Vec3f moved = fallen.probes[59][probe] - fallen.probes[50][probe];
    EXPECT_LT(length(moved), 0.05F * kTraySpacing_m) << probe;
    EXPECT_LT(fallen.probes[59][probe].y, 0.48F);
  }
  const Fallen again = fall("cpu:3", 60);
  EXPECT_TRUE(fallen.probes == again.probes);
  EXPECT_TRUE(fall("cpu", 60, false).probes == fall("cpu:3", 60, false).probes);
}

TEST(CutScene, SeveredPartsDoNotCreep) {
  if (std::getenv("TACTUS_LONG_TESTS") == nullptr) GTEST_SKIP() << "60 s of a scene: set TACTUS_LONG_TESTS=1";
  const Fallen fallen = fall("cpu", 60 + 60 * 30);
  for (const std::size_t probe : {1U, 2U}) {
    const Vec3f moved = fallen.probes.back()[probe] - fallen.probes[59][probe];
    EXPECT_LT(length(moved), 0.05F * kTraySpacing_m) << probe;
  }
}

/// Where a body is on several devices, its nodes were gathered before the frame's cut: new ones were read
/// where the first node of the lattice is at rest, and the skin, strains and hashes of that frame with them.
TEST(CutScene, NewNodesAreReadWhereTheyAreOnSeveralDevices) {
  const Scene scene = read_scene(source_path("scenes/slice.yaml"));
  DeviceSet one("cpu"), three("cpu:3", 3);
  test::FilmedWorld on_one(one, scene, {}, {}), on_three(three, scene, {}, {});
  ASSERT_EQ(on_three.bodies()[0]->tissue().slab_count(), 3);
  for (int k = 0; k < 19; ++k) {
    on_one.step(nullptr, k > 0 ? 1.0 / 30 : 0);
    on_three.step(nullptr, k > 0 ? 1.0 / 30 : 0);
    for (std::size_t b = 0; b < 2; ++b) {
      EXPECT_EQ(on_one.bodies()[b]->positions_m(on_one.context()),
                on_three.bodies()[b]->positions_m(on_three.context()))
          << "frame " << k;
      EXPECT_EQ(on_one.snapshot().bodies[b].positions_m, on_three.snapshot().bodies[b].positions_m);
    }
  }
  EXPECT_GT(on_one.bodies()[0]->cuts()->state(on_one.context()).copies, 0);
}

TEST(CutScene, SaysWhatItCanNotCut) {
  Scene scene = parse_scene(scene_text(), "scenes/x.yaml");
  scene.bodies[0].cut_capacity = 20;
  const auto has = [](const Played& played, const char* code) {
    // Once a stroke.
    return std::count_if(played.notices.begin(), played.notices.end(),
                         [&](const Notice& n) { return n.code == code; }) == 1;
  };
  const Played full = play(scene, "cpu");
  EXPECT_TRUE(has(full, "cut.full"));
  // 8 x 8 x 4 cubes at least: 13 copies each.
  EXPECT_NE(full.notices.at(0).remedy.find(" hold 50 straight strokes"), std::string::npos)
      << full.notices[0].remedy;
  EXPECT_EQ(full.state.parts, 1);
  scene.bodies[0].cut_capacity = 400;
  MovedRegion grip;
  grip.name = "grip";
  grip.where.box = {{0.09, -0.11, -0.06}, {0.11, 0.05, 0.06}};
  grip.path = {{1, {}, 0}};
  scene.bodies[0].moved = {grip};
  const Played refused = play(scene, "cpu");
  EXPECT_TRUE(has(refused, "cut.refused"));
  EXPECT_EQ(refused.state.parts, 1);
  EXPECT_GT(refused.state.copies, 0);
}

/// A blade goes through elements into shape matching: it cuts up to the interface, says so once, and the body
/// goes on.
TEST(CutScene, StopsAtTheInterface) {
  Scene scene = parse_scene(scene_text(), "scenes/x.yaml");
  scene.bodies[0].material.model = TissueModel::hybrid;
  scene.bodies[0].ratio = RatioDescription{};
  const Played played = play(scene, "cpu"), again = play(scene, "cpu:3");
  EXPECT_EQ(played.state.parts, 1);
  EXPECT_GT(played.state.copies, 0);
  ASSERT_EQ(played.notices.size(), 1U);
  EXPECT_EQ(played.notices[0].code, "cut.refused");
  EXPECT_TRUE(played.probes == again.probes);
}

/// A grip holds a block, and its lower end is loaded. Once a blade has severed it, the grip holds the weight
/// of what is left, and the load goes with the part that falls. What still swings is the tolerance, 1 %.
TEST(CutScene, LoadsAndMovedNodesFollow) {
  Scene scene = parse_scene(scene_text(), "scenes/x.yaml");
  BodyDescription& body = scene.bodies[0];
  body.fixed.clear();
  body.material.damping = 0.7;
  MovedRegion grip;
  grip.name = "grip";
  grip.where.box = {{-0.11, 0.06, -0.06}, {0.11, 0.11, 0.06}};
  grip.path = {{0, {}, 0}};
  body.moved = {grip};
  LoadedRegion pull;
  pull.name = "pull";
  pull.where.box = {{-0.2, -0.11, -0.2}, {0.2, -0.09, 0.2}};
  pull.force_n = {0, -5, 0};
  body.loads = {pull};
  DeviceSet devices("cpu", 3);
  SyntheticOptions options;
  options.figure = "sphere";
  options.depth = options.truth = false;
  SyntheticSource source(options);
  test::FilmedWorld simulation(devices, scene, source.rig(), {});
  Vec3d before{}, after{}, force_N{};
  for (int k = 0; k < 60; ++k) {
    simulation.step(nullptr, 1.0 / 30);
    before = std::exchange(after, simulation.monitors()[0].momentum_kg_m_s);
    if (k >= 50) force_N += simulation.motion_forces()[0][0].force_N / 10.0;
  }
  const SoftBody& block = *simulation.bodies()[0];
  const std::vector<Vec3f> x_m = block.positions_m(simulation.context());
  double upper_kg = 0, lower_kg = 0;
  for (std::size_t i = 0; i < x_m.size(); ++i)
    (x_m[i].y > 0.3F ? upper_kg : lower_kg) += double{block.shape().lattice.node_mass_kg[i]};
  EXPECT_EQ(block.cuts()->state(simulation.context()).parts, 2);
  EXPECT_NEAR(upper_kg + lower_kg, 4, 1e-5);
  EXPECT_GT(lower_kg, 0.5);
  EXPECT_NEAR(force_N.y, 9.81 * upper_kg, 0.01 * 9.81 * upper_kg);
  EXPECT_NEAR(30 * (before - after).y, 9.81 * lower_kg + 5, 0.01 * (9.81 * lower_kg + 5));
}

/// A blade that jumps by 0.9 m in a frame cuts nothing, and says so.
TEST(CutScene, DoesNotCutWhereABladeJumps) {
  Scene scene = parse_scene(scene_text(), "scenes/x.yaml");
  scene.blades[0].path[1].displacement_m = {9, 0, 0};
  scene.blades[0].path[1].time_s = 0.4;
  const Played played = play(scene, "cpu");
  ASSERT_EQ(played.notices.size(), 1U);
  EXPECT_EQ(played.notices[0].code, "cut.jump");
  // The first frame with the blade has all of its 0.1 s to 0.1333 s.
  EXPECT_EQ(played.notices[0].text,
            "blade 'slicer' moves by 1 m in a frame, expected at most 0.2 m; it cuts nothing there");
  EXPECT_EQ(played.state.copies, 0);
}

/// The limit of docs/scene.md: 0.21 m a frame is too far, 0.19 m cuts.
TEST(CutScene, ABladesPathMayGo20CentimetresAFrame) {
  for (const double way_m : {0.19, 0.21}) {
    Scene scene = parse_scene(scene_text(), "scenes/x.yaml");
    scene.blades[0].path[1] = {0.4, {9 * way_m, 0, 0}, 0};
    const Played played = play(scene, "cpu");
    const bool is_told = std::any_of(played.notices.begin(), played.notices.end(),
                                     [](const Notice& n) { return n.code == "cut.jump"; });
    EXPECT_EQ(is_told, way_m > 0.2) << way_m;
    EXPECT_EQ(played.state.copies > 0, way_m < 0.2) << way_m;
  }
}

TEST(CutScene, RefusesBladesAndBodiesByName) {
  const auto error_of = [](const char* what, const char* instead) {
    std::string text = scene_text();
    const std::size_t place = text.find(what);
    EXPECT_NE(place, std::string::npos) << what;
    text.replace(place, std::string(what).size(), instead);
    return test::message_of([&] { parse_scene(text, "scenes/x.yaml"); }, ErrorKind::usage);
  };
  const auto expect = [&](const char* what, const char* instead, const char* part) {
    const std::string message = error_of(what, instead);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect("cuttable: true", "cuttable: false", "cut_capacity");
  expect("    cuttable: true\n    cut_capacity: 400\n", "", "no body has 'cuttable: true'");
  expect("model: tled, young_modulus_pa: 30000, poisson_ratio: 0.4", "model: flsm", "no elements");
  expect("time_s: 0.5", "time_s: 0.05",
         "scenes/x.yaml:18: in 'blades[0]': 'path[1]' has a 'time_s' of 0.05, expected more than the one "
         "before it, 0.1");
  expect("displacement_m: [0.3, 0, 0]", "displacement_m: [0, 0, 0.3]", "'path' sweeps an area of 0 m^2");
  expect("displacement_m: [0.3, 0, 0]", "displacement_m: [0.3, .nan, 0]", "displacement_m' is '.nan'");
  expect("{time_s: 0.1}, ", "", "expected two or more");
  expect("to_m: [-0.15, 0.56, 0.7]", "to_m: [-0.15, 0.56, 0.5]", "no length");
  expect("time_s: 0.1}", "time_s: .nan}", "time_s");
}

}  // namespace
}  // namespace tactus
