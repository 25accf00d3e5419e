/// Parameters of a scene that change while it runs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/device_sets.h"
#include "support/message_of.h"
#include "support/probe_readings.h"
#include "support/sliced_block.h"
#include "tactus/io/scene_file.h"
#include "tactus/io/scene_numbers.h"
#include "tactus/world/world.h"

namespace tactus {
namespace {

constexpr double kFrame_s = 1.0 / 60;

/// A bar of 0.2 x 0.04 x 0.04 m that is held at one end and sags, with a part that is twice as stiff.
Scene bar_scene(const std::string& model, double young_Pa) {
  Scene scene = parse_scene(R"(
source: {kind: none}
bodies:
  - name: bar
    shape: {kind: box, size_m: [0.2, 0.04, 0.04]}
    placement: {position_m: [0, 0.5, 0]}
    spacing_m: 0.02
    material: {drag_per_s: 4}
    fixed: [{kind: half_space, point_m: [-0.09, 0, 0], normal: [1, 0, 0]}]
probes: [{name: tip, body: bar, position_m: [0.1, 0, 0]}, {name: root, body: bar, position_m: [-0.06, 0.01, 0]}]
)",
                            "scenes/x.yaml");
  MaterialDescription& material = scene.bodies[0].material;
  material.model = model == "flsm" ? TissueModel::flsm : TissueModel::tled;
  material.young_modulus_pa = young_Pa;
  if (model == "tled") {
    PaintedRegion stiff;
    stiff.where.box = {{-0.1, -0.02, -0.02}, {-0.04, 0.02, 0.02}};
    stiff.young_modulus_pa = 2 * young_Pa;
    scene.bodies[0].regions = {stiff};
  }
  return scene;
}

double tip_m(World& world) { return double{probe_positions_m(world)[0].y}; }

/// A body whose stiffness is set moves as one that was built so. Positions are floats, rounded by 3e-8 m at
/// 0.5 m; a damped bar that sags by 0.1 m doesn't let a few hundred of these become more than 16: 5e-7 m.
/// Over a cube of 2 cm that is 2.5e-5 of strain, where the root has 0.05: 5e-4 of its stress, and 1e-3 of
/// energies.
TEST(SceneParameters, StiffnessThatIsSetIsStiffnessThatIsBuilt) {
  for (const std::string model : {"tled", "flsm"}) {
    DeviceSet devices("cpu");
    World set(devices, bar_scene(model, 20000), {}), built(devices, bar_scene(model, 50000), {});
    set.parameters().set("bodies.bar.material.young_modulus_pa", 50000);
    for (int k = 0; k < 30; ++k) {
      const StepReport a = set.step(kFrame_s), b = built.step(kFrame_s);
      EXPECT_EQ(a.substeps, b.substeps) << model << " " << k;
    }
    EXPECT_LT(tip_m(built), 0.499) << model << ": it sags";
    EXPECT_NEAR(tip_m(set), tip_m(built), 5e-7) << model;
    if (model == "flsm") continue;  // stress is known of elements alone
    const double root_Pa = built.probes()[1].strain.von_mises_Pa(), bent_J = built.monitors()[0].elastic_J;
    EXPECT_GT(root_Pa, 1000);
    EXPECT_NEAR(set.probes()[1].strain.von_mises_Pa(), root_Pa, 5e-4 * root_Pa);
    EXPECT_NEAR(set.monitors()[0].elastic_J, bent_J, 1e-3 * bent_J);
  }
}

/// And going back makes it what it was, to the bit: nothing is rounded twice.
TEST(SceneParameters, GoingBackLeavesNoTrace) {
  DeviceSet devices("cpu");
  World changed(devices, bar_scene("tled", 20000), {}), plain(devices, bar_scene("tled", 20000), {});
  changed.parameters().set("bodies.bar.material.young_modulus_pa", 33333.3);
  changed.parameters().set("bodies.bar.material.young_modulus_pa", 20000);
  for (int k = 0; k < 5; ++k) {
    changed.step(kFrame_s);
    plain.step(kFrame_s);
  }
  EXPECT_EQ(probe_positions_m(changed), probe_positions_m(plain));
}

/// A block that slides down a slope of 25 degrees; its friction is 0 at first.
constexpr const char* kSlope = R"(
source: {kind: none}
bodies:
  - name: block
    shape: {kind: box, size_m: [0.1, 0.04, 0.1]}
    placement: {position_m: [0, 0.0201, 0]}
    spacing_m: 0.02
    material: {model: tled, young_modulus_pa: 30000}
obstacles: [{name: floor, kind: plane}]
contact: {friction: 0}
)";

double speed_m_s(World& world) {
  return length(world.monitors()[0].momentum_kg_m_s) / 0.4;  // its mass [kg]
}

/// Gravity turns by 25 degrees: it slides with g sin 25. Friction of 1 then stops it, and gravity that is off
/// leaves it there. 3 % as blocks on slopes elsewhere.
TEST(SceneParameters, GravityAndFrictionActFromTheNextFrame) {
  DeviceSet devices("cpu");
  World world(devices, parse_scene(kSlope, "scenes/x.yaml"), {});
  constexpr double g = 9.81, slope = 25 * 3.14159265358979 / 180;
  for (int k = 0; k < 30; ++k) world.step(kFrame_s);
  EXPECT_LT(speed_m_s(world), 0.01) << "it lies";
  SceneParameters& parameters = world.parameters();
  parameters.set("gravity_m_s2.x", g * std::sin(slope));
  parameters.set("gravity_m_s2.y", -g * std::cos(slope));
  for (int k = 0; k < 30; ++k) world.step(kFrame_s);
  const double slid_m_s = 0.5 * g * std::sin(slope);
  EXPECT_NEAR(speed_m_s(world), slid_m_s, 0.03 * slid_m_s);
  parameters.set("contact.friction", 1);
  // g (cos - sin) takes 0.43 s of it.
  for (int k = 0; k < 60; ++k) world.step(kFrame_s);
  EXPECT_LT(speed_m_s(world), 0.01);
  for (const char* axis : {"gravity_m_s2.x", "gravity_m_s2.y"}) parameters.set(axis, 0);
  const double before_m = double{world.snapshot().bodies[0].positions_m[0].y};
  for (int k = 0; k < 30; ++k) world.step(kFrame_s);
  // With what its own weight had stored in it, it rises by 16 mm; it would have fallen by 1.2 m.
  EXPECT_NEAR(double{world.snapshot().bodies[0].positions_m[0].y}, before_m, 0.03);
}

/// Drag of 2 / s takes exp(-1) of a flight's speed in half a second.
TEST(SceneParameters, DragActsFromTheNextFrame) {
  Scene scene = parse_scene(kSlope, "scenes/x.yaml");
  scene.obstacles.clear();
  DeviceSet devices("cpu");
  World world(devices, scene, {});
  for (int k = 0; k < 30; ++k) world.step(kFrame_s);
  world.parameters().set("gravity_m_s2.y", 0);
  world.step(kFrame_s);
  const double before_m_s = speed_m_s(world);
  world.parameters().set("bodies.block.material.drag_per_s", 2);
  for (int k = 0; k < 30; ++k) world.step(kFrame_s);
  EXPECT_NEAR(speed_m_s(world), before_m_s * std::exp(-1.0), 0.01 * before_m_s);
}

/// Twice the rate is twice the volume due, up to a particle's rounding to whole units.
TEST(SceneParameters, BleedingActsFromTheNextFrame) {
  const auto due_m3 = [](double rate_m_s) {
    Scene scene = parse_scene(std::string(kSlicedBlock) + R"(
fluid:
  spacing_m: 0.01
  box: {min_m: [-0.3, 0, 0.3], max_m: [0.3, 0.8, 0.9]}
)",
                              "scenes/x.yaml");
    scene.bodies[0].contact = true;
    scene.bodies[0].bleeding = BleedingDescription{0.001, {}, {}};
    DeviceSet devices("cpu");
    World world(devices, scene, {});
    world.parameters().set("bodies.block.bleeding.rate_m_s", rate_m_s);
    for (int k = 0; k < 18; ++k) world.step(1.0 / 30);
    return world.cuts().at(0).due_m3;
  };
  const double once_m3 = due_m3(0.001);
  EXPECT_GT(once_m3, 1e-7);
  EXPECT_NEAR(due_m3(0.002), 2 * once_m3, 1e-3 * once_m3);
}

class SceneParametersOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(SceneParametersOnDevices);

struct Played {
  std::vector<Vec3f> x_m;
  std::string file;
};

/// 12 frames in which everything changes. @param from 0, or 6: goes on from the file
Played play(const std::string& devices_text, int from, int to, const std::string& file) {
  DeviceSet devices(devices_text, 3);
  Scene scene = parse_scene(kSlope, "scenes/x.yaml");
  scene.bodies.push_back(bar_scene("tled", 20000).bodies[0]);
  scene.bodies.push_back(bar_scene("flsm", 20000).bodies[0]);
  scene.bodies[1].placement.position_m = {0.5, 0.5, 0};
  scene.bodies[2].name = "matched";
  scene.bodies[2].placement.position_m = {1, 0.5, 0};
  World world(devices, scene, {});
  if (from > 0) {
    world.load_state(file);
  }
  for (int k = from; k < to; ++k) {
    SceneParameters& p = world.parameters();
    if (k == 3) p.set("bodies.bar.material.young_modulus_pa", 40000);
    if (k == 4) p.set("bodies.matched.material.young_modulus_pa", 8000);
    if (k == 5) p.set("contact.friction", 0.3);
    if (k == 8) p.set("gravity_m_s2.x", 3);
    if (k == 9) p.set("bodies.bar.material.drag_per_s", 20);
    world.step(kFrame_s);
  }
  Played played;
  for (const BodyDescription& body : scene.bodies) {
    const std::vector<Vec3f> x_m = world.nodes(body.name).positions_m;
    played.x_m.insert(played.x_m.end(), x_m.begin(), x_m.end());
  }
  played.file = world.save_state();
  return played;
}

TEST_P(SceneParametersOnDevices, ChangesHaveTheSameBits) {
  static const Played on_cpu = play("cpu", 0, 12, "");
  EXPECT_EQ(play(GetParam(), 0, 12, "").x_m, on_cpu.x_m) << "a recorded frame is recorded anew";
}

TEST_P(SceneParametersOnDevices, ACheckpointHoldsThem) {
  const Played whole = play(GetParam(), 0, 12, ""), first = play(GetParam(), 0, 6, "");
  EXPECT_EQ(play(GetParam(), 6, 12, first.file).x_m, whole.x_m);
}

TEST(SceneParameters, OthersAreRefusedByName) {
  DeviceSet devices("cpu");
  World world(devices, bar_scene("tled", 20000), {});
  SceneParameters& parameters = world.parameters();
  const auto message = [&](const std::string& name, double value) {
    return test::message_of([&] { parameters.set(name, value); }, ErrorKind::usage);
  };
  EXPECT_EQ(message("contact.fricton", 1),
            "parameter 'contact.fricton' is unknown; did you mean 'contact.friction'?");
  EXPECT_EQ(message("contact.friction", -1), "parameter 'contact.friction' is -1, expected >= 0 and <= 10");
  EXPECT_EQ(message("bodies.bar.material.young_modulus_pa", 0),
            "parameter 'bodies.bar.material.young_modulus_pa' is 0, expected >= 0.02 and <= 1e+09 Pa");
  EXPECT_EQ(message("gravity_m_s2.y", std::nan("")).rfind("parameter 'gravity_m_s2.y' is nan, expected", 0),
            0U);
  EXPECT_EQ(message("bodies.bar.spacing_m", 0.01)
                .rfind("parameter 'bodies.bar.spacing_m' can't change while the scene runs: change it in the "
                       "scene file and start anew",
                       0),
            0U);
  EXPECT_EQ(parameters.get("contact.friction"), 0.4);
  EXPECT_EQ(parameters.get("bodies.bar.material.young_modulus_pa"), 20000);
}

/// Each says its unit and its range, as the schema does.
TEST(SceneParameters, AreListedWithUnitAndRange) {
  DeviceSet devices("cpu");
  World world(devices, bar_scene("tled", 20000), {});
  for (const SceneParameter& p : world.parameters().list()) {
    EXPECT_FALSE(p.meaning.empty()) << p.name;
    EXPECT_TRUE(p.least <= p.value && p.value <= p.most) << p.name;
  }
  EXPECT_EQ(scene_number("bodies[].material.drag_per_s").unit, "1/s");
  EXPECT_EQ(world.parameters().list().size(), 10U)
      << "three of gravity, two of contact, two of the bar, three of the pictures' camera";
}

/// Snapshots have the new angles at once; nodes have the bits of a world that nobody looks at.
TEST(SceneParameters, TheCameraOfPicturesTurnsAndPhysicsDoesNotKnow) {
  DeviceSet devices("cpu");
  World turned(devices, bar_scene("tled", 20000), {}), plain(devices, bar_scene("tled", 20000), {});
  for (int k = 0; k < 3; ++k) {
    turned.parameters().set("view.camera.azimuth_deg", 90 + 10 * k);
    EXPECT_EQ(turned.snapshot().view.azimuth_deg, 90 + 10 * k);
    turned.step(kFrame_s);
    plain.step(kFrame_s);
  }
  EXPECT_EQ(state_hash(turned), state_hash(plain));
  EXPECT_EQ(plain.snapshot().view.azimuth_deg, 30) << "the schema's default";
  EXPECT_EQ(turned.parameters().of(ParameterEffect::next_picture).size(), 3U);
  EXPECT_STREQ(effect_text(turned.parameters().list().back().effect), "next picture");
  EXPECT_STREQ(effect_text(turned.parameters().list().front().effect), "next frame");
}

}  // namespace
}  // namespace tactus
