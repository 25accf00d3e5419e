/// Obstacles that keyframes or a program move.
#include <gtest/gtest.h>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/geom/mesh/sphere_surface.h"

namespace tactus {
namespace {

constexpr double kFrame_s = 1.0 / 50;

/// A free block of 4 cm without gravity, and a ball of 1 cm radius above it.
Scene ball_and_block() {
  Scene scene;
  scene.source.kind = SourceKind::none;
  scene.gravity_m_s2 = {};
  BodyDescription& block = scene.bodies.emplace_back();
  block.name = "block";
  block.shape.kind = ShapeKind::box;
  block.shape.size_m = {0.04, 0.04, 0.04};
  block.spacing_m = 0.01;
  block.material.young_modulus_pa = 20000;
  ObstacleSetting& ball = scene.obstacles.emplace_back();
  ball.name = "ball";
  ball.kind = ObstacleShape::sphere;
  ball.radius_m = 0.01;
  ball.placement.position_m = {0, 0.035, 0};
  ball.held = true;
  return scene;
}

Vec3d momentum_kg_m_s(test::FilmedWorld& simulation) { return simulation.monitors()[0].momentum_kg_m_s; }

/// A chord of the mesh is inside of the ball, so its volume would be too small: it is scaled to be right.
TEST(SphereSurface, HasTheVolumeOfTheBall) {
  const TriangleMesh mesh = sphere_surface(0.02F, 16);
  EXPECT_NEAR(volume_m3(mesh) / (4 * M_PI / 3 * 8e-6), 1, 1e-5);
  float least = 1, most = 0;
  for (const Vec3f p : mesh.positions_m) least = std::min(least, length(p)), most = std::max(most, length(p));
  // Squares of 1/16 of a quarter turn: sags of (pi / 32)^2 / 8 of the radius, of which scaling takes half.
  EXPECT_NEAR(least / 0.02F, 1, 0.002);
  EXPECT_NEAR(most / 0.02F, 1, 0.002);
}

class MovingObstacle : public ::testing::TestWithParam<std::string> {};
TACTUS_INSTANTIATE_DEVICES(MovingObstacle);

/// What the ball gets is what the block loses: impulses are summed in float over some 500 contacts
/// a frame, so 500 roundings of 6e-8 each, 3e-5.
TEST_P(MovingObstacle, GivesTheBodyWhatItLoses) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  Scene scene = ball_and_block();
  DeviceSet devices(GetParam());
  test::FilmedWorld simulation(devices, scene, {}, {});
  Vec3d given{};
  for (int f = 0; f <= 25; ++f) {
    simulation.set_pose("ball", {Mat3d::identity(), {0, 0.035 - 0.1 * kFrame_s * f, 0}});
    const StepReport report = simulation.step(nullptr, f > 0 ? kFrame_s : 0);
    for (const BodyContact& c : report.contacts) {
      EXPECT_EQ(c.component, "ball");
      given -= vec_cast<double>(c.reaction.impulse_N_s);
    }
  }
  const Vec3d has = momentum_kg_m_s(simulation);
  EXPECT_LT(has.y, -1e-4) << "it was pushed down";
  EXPECT_LT(length(has - given), 1e-4 * length(has));
  EXPECT_NEAR(simulation.snapshot().obstacles.at(0).positions_m.size(), 16 * 16 * 6 + 2, 1);
}

/// Keyframes and a program that sets the same poses give the same bits.
TEST_P(MovingObstacle, FollowsKeyframesAsItFollowsAProgram) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  Scene held = ball_and_block(), keyed = ball_and_block();
  keyed.obstacles[0].held = false;
  keyed.obstacles[0].motion = {{0, {}, 0}, {0.5, {0.01, -0.05, 0}, 90}};
  keyed.obstacles[0].axis = {0, 0, 1};
  DeviceSet devices(GetParam());
  test::FilmedWorld a(devices, held, {}, {}), b(devices, keyed, {}, {});
  for (int f = 0; f <= 25; ++f) {
    b.step(nullptr, f > 0 ? kFrame_s : 0);
    a.set_pose("ball", b.pose("ball"));
    a.step(nullptr, f > 0 ? kFrame_s : 0);
  }
  EXPECT_EQ(a.bodies()[0]->positions_m(a.context()), b.bodies()[0]->positions_m(b.context()));
  // A quarter of a turn in half a second, and 1 cm aside.
  const Rigidd pose = b.pose("ball");
  EXPECT_NEAR(pose.t.x, 0.01, 1e-12);
  EXPECT_NEAR(pose.R(1, 0), 1, 1e-12);
}

/// A ball that comes at 5 m/s, 10 spacings a frame, throws the block: at least as fast as itself, and at most
/// twice as fast, as a hard block from a heavy ball. (Its radius is two spacings. One of a single spacing
/// goes through so fast: that is below what the lattice resolves.)
TEST_P(MovingObstacle, ThrowsTheBlockAtFiveMetresASecond) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  Scene scene = ball_and_block();
  scene.bodies[0].material.young_modulus_pa = 2e5;
  scene.obstacles[0].radius_m = 0.02;
  scene.obstacles[0].placement.position_m = {0, 0.045, 0};
  DeviceSet devices(GetParam());
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.step(nullptr, 0);
  for (int f = 1; f <= 4; ++f) {
    simulation.set_pose("ball", {Mat3d::identity(), {0, 0.045 - 5 * kFrame_s * f, 0}});
    simulation.step(nullptr, kFrame_s);
  }
  constexpr double kMass_kg = 0.064;  // of 1000 kg/m^3
  const double speed_m_s = -momentum_kg_m_s(simulation).y / kMass_kg;
  EXPECT_GT(speed_m_s, 5);
  EXPECT_LT(speed_m_s, 10);
  EXPECT_LT(simulation.bodies()[0]->status().motion.center_m.y, 0.045 - 5 * 4 * kFrame_s - 0.04);
}

TEST(HeldObstacle, RefusesWrongNamesAndPoses) {
  Scene scene = ball_and_block();
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  const auto message = [&](const std::string& name, const Rigidd& pose) -> std::string {
    try {
      simulation.set_pose(name, pose);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message("bal", {}), "'bal' is no obstacle or blade with 'held: true'; did you mean 'ball'?");
  Rigidd scaled{Mat3d::identity(), {}};
  scaled.R(0, 0) = 2;
  EXPECT_EQ(message("ball", scaled),
            "pose of obstacle 'ball': R^T R differs from 1 by 3, expected a rotation: at most 0.001");
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      Rigidd hole{Mat3d::identity(), {}};
      hole.R(i, k) = NAN;
      EXPECT_EQ(message("ball", hole),
                "pose of obstacle 'ball': R^T R differs from 1 by nan, expected a rotation: at most 0.001");
    }
  EXPECT_EQ(
      message("ball", {Mat3d::identity(), {NAN, 0, 0}}),
      "pose of obstacle 'ball': its position [nan, 0, 0] m is expected to be finite, and at most 1e6 m away");
}

/// A program turns a tool by floats: 1,000 small turns leave R^T R off by about 1,000 ulps of a float, 1e-4.
TEST(HeldObstacle, TakesTheNearestRotationToOneOfFloats) {
  Scene scene = ball_and_block();
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  Mat3f turned = Mat3f::identity();
  const Mat3f step = mat_cast<float>(rotation_from_vector(Vec3d{0.01, 0.02, 0.03}));
  for (int k = 0; k < 1000; ++k) turned = step * turned;
  const Mat3d given = mat_cast<double>(transpose(turned) * turned);
  EXPECT_GT(std::abs(given(0, 0) - 1) + std::abs(given(1, 1) - 1) + std::abs(given(2, 2) - 1), 1e-6)
      << "there is something to mend";
  simulation.set_pose("ball", {mat_cast<double>(turned), {0, 1, 0}});
  simulation.World::step(0);
  const Mat3d R = simulation.pose("ball").R;
  const Mat3d product = transpose(R) * R;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(product(i, k), i == k ? 1 : 0, 1e-9) << "exact to what is taken as it is";
      EXPECT_NEAR(R(i, k), static_cast<double>(turned(i, k)), 1e-3) << "near what was given";
    }
}

/// A state goes to a scene with the same values, whatever its pictures and title; parameters may have
/// changed.
TEST(WorldState, IsOfOneScene) {
  const Scene scene = ball_and_block();
  DeviceSet devices("cpu");
  World world(devices, scene, {});
  world.parameters().set("bodies.block.material.young_modulus_pa", 30000);
  world.step(kFrame_s);
  const std::string state = world.save_state();
  const auto message = [&](auto&& edit) {
    Scene edited = scene;
    edit(edited);
    World other(devices, edited, {});
    return test::message_of([&] { other.load_state(state); }, ErrorKind::usage);
  };
  EXPECT_EQ(message([](Scene&) {}), "");
  EXPECT_EQ(message([](Scene& s) {
              s.name = "another title";
              s.view.camera.azimuth_deg = 10;
              s.output.mesh_every = 5;
            }),
            "");
  const auto refused = [](const std::string& key) {
    return "load_state: the state is of a scene with other '" + key + "', or this one was edited since";
  };
  EXPECT_EQ(message([](Scene& s) { s.bodies[0].material.young_modulus_pa = 30000; }), refused("bodies"));
  EXPECT_EQ(message([](Scene& s) { s.bodies[0].material.density_kg_m3 += 1; }), refused("bodies"));
  EXPECT_EQ(message([](Scene& s) { s.bodies[0].placement.position_m.x = 1e-9; }), refused("bodies"));
  EXPECT_EQ(message([](Scene& s) { s.bodies[0].fixed.push_back({}); }), refused("bodies"));
  EXPECT_EQ(message([](Scene& s) { s.obstacles[0].radius_m = 0.011; }), refused("obstacles"));
  EXPECT_EQ(message([](Scene& s) { s.contact.friction = 0; }), refused("contact"));
  EXPECT_EQ(message([](Scene& s) { s.gravity_m_s2 = {0, -9.81, 0}; }), refused("gravity_m_s2"));
}

/// Examples change scenes that they read: read_scene() has not seen these.
TEST(WorldOfAChangedScene, NamesAFieldThatWouldEndIt) {
  DeviceSet devices("cpu");
  const auto message = [&](auto&& edit) {
    Scene scene = ball_and_block();
    edit(scene);
    return test::message_of([&] { World(devices, scene, {}); }, ErrorKind::usage);
  };
  EXPECT_EQ(message([](Scene&) {}), "");
  EXPECT_EQ(message([](Scene& s) { s.bodies[0].matching_every = 0; }),
            "'bodies.block.matching_every' is 0, expected at least 1");
  EXPECT_EQ(message([](Scene& s) { s.frame.substeps = 0; }), "'frame.substeps' is 0, expected at least 1");
  EXPECT_EQ(message([](Scene& s) {
              s.gravity_m_s2 = {0, NAN, 0};
            }),
            "'gravity_m_s2' is [0, nan, 0], expected to be finite");
  EXPECT_EQ(message([](Scene& s) { s.obstacles[0].name = "block"; }),
            "'obstacles': 'block' is the name of two things, names must differ");
  EXPECT_EQ(message([](Scene& s) { s.bodies[0].material.young_modulus_pa = -1; }),
            "'bodies.block.material.young_modulus_pa' is -1, expected > 0 Pa");
  EXPECT_EQ(message([](Scene& s) { s.bodies[0].shape.kind = ShapeKind::mesh; }),
            "body 'block': its file isn't among the assets; expected load_body_assets(scene)");
}

TEST(MeshOfAProgram, NamesACornerThatIsNotThere) {
  TriangleMesh mesh = sphere_surface(1, 2);
  mesh.triangles[3][1] = 1000000;
  const std::string expected = "triangle 3 of a mesh names vertex 1000000, expected 0 to " +
                               std::to_string(mesh.positions_m.size() - 1);
  EXPECT_EQ(test::message_of([&] { topology(mesh); }), expected);
  EXPECT_EQ(test::message_of([&] { volume_m3(mesh); }), expected);
  EXPECT_EQ(test::message_of([&] { compute_normals(mesh); }), expected);
}

}  // namespace
}  // namespace tactus
