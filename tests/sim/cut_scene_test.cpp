/// Bodies of a scene that blades cut.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic_source.h"
#include "tactus/sim/simulation.h"

namespace tactus {
namespace {

/// A block of 0.2 m hangs from its top; a blade goes through it below, and through a cube that is moved.
constexpr const char* kScene = R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
bodies:
  - name: block
    contact: false
    cuttable: true
    cut_room: 400
    shape: {kind: box, size_m: [0.2, 0.2, 0.1]}
    placement: {position_m: [0, 0.6, 0.6]}
    spacing_m: 0.025
    material: {model: tled, young_modulus_pa: 30000, poisson_ratio: 0.4}
    fixed: [{kind: half_space, point_m: [0, 0.09, 0], normal: [0, -1, 0]}]
blades:
  - name: slicer
    from_m: [-0.15, 0.56, 0.5]
    to_m: [-0.15, 0.56, 0.7]
    path: [{time_s: 0.1}, {time_s: 0.5, displacement_m: [0.3, 0, 0]}]
probes:
  - {name: above, body: block, position_m: [0, 0.05, 0]}
  - {name: below, body: block, position_m: [0, -0.08, 0]}
)";

struct Played {
  std::vector<Vec3f> probes;
  SoftBody::CutState state;
  std::vector<CutScore> cuts;
  std::vector<Notice> notices;
};

Played play(const Scene& scene, const char* devices_text) {
  DeviceSet devices(devices_text, 3);
  SyntheticOptions options;
  options.figure = "sphere";
  options.depth = options.truth = false;
  SyntheticSource source(options);
  Simulation simulation(devices, scene, source.rig(), {});
  Played played;
  for (int k = 0; k < 24; ++k) {
    const StepReport report = simulation.step(nullptr, 1.0 / 30);
    played.notices.insert(played.notices.end(), report.notices.begin(), report.notices.end());
  }
  played.probes = simulation.probe_positions_m();
  played.state = simulation.bodies()[0]->cut_state(simulation.context());
  played.cuts = simulation.cuts();
  return played;
}

/// The lower part falls from when it is severed, about 0.4 s, and its probe with it; the upper one stays. The
/// incision has the area of the block's section.
TEST(CutScene, ABladeSeversABlock) {
  const Scene scene = parse_scene(kScene, "scenes/x.yaml");
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

TEST(CutScene, SaysWhatItCanNotCut) {
  Scene scene = parse_scene(kScene, "scenes/x.yaml");
  scene.bodies[0].cut_room = 20;
  const auto has = [](const Played& played, const char* code) {
    // Once a stroke.
    return std::count_if(played.notices.begin(), played.notices.end(),
                         [&](const Notice& n) { return n.code == code; }) == 1;
  };
  const Played full = play(scene, "cpu");
  EXPECT_TRUE(has(full, "cut.full"));
  EXPECT_EQ(full.state.parts, 1);
  scene.bodies[0].cut_room = 400;
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

TEST(CutScene, RefusesBladesAndBodiesByName) {
  const auto error_of = [](const char* what, const char* instead) {
    std::string text = kScene;
    const std::size_t place = text.find(what);
    EXPECT_NE(place, std::string::npos) << what;
    text.replace(place, std::string(what).size(), instead);
    return test::message_of([&] { parse_scene(text, "scenes/x.yaml"); }, ErrorKind::usage);
  };
  const auto expect = [&](const char* what, const char* instead, const char* part) {
    const std::string message = error_of(what, instead);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect("cuttable: true", "cuttable: false", "cut_room");
  expect("    cuttable: true\n    cut_room: 400\n", "", "no body has 'cuttable: true'");
  expect("contact: false", "contact: true", "expected 'contact: false'");
  expect("model: tled, young_modulus_pa: 30000, poisson_ratio: 0.4", "model: flsm", "no elements");
  expect("time_s: 0.5", "time_s: 0.05", "more than the one before it");
  expect("{time_s: 0.1}, ", "", "expected two or more");
  expect("to_m: [-0.15, 0.56, 0.7]", "to_m: [-0.15, 0.56, 0.5]", "no length");
  expect("time_s: 0.1}", "time_s: .nan}", "time_s");
}

}  // namespace
}  // namespace tactus
