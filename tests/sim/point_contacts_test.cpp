/// Contacts of a body as data: World::contacts.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "tactus/base/error.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {
namespace {

constexpr double kFrame_s = 1.0 / 50, kMass_kg = 0.064;

/// A block of 4 cm and 1000 kg/m^3 without gravity, and a ball above it that a program holds.
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

/// The same block on a table.
Scene block_on_table() {
  Scene scene = ball_and_block();
  scene.gravity_m_s2 = {0, -9.81, 0};
  scene.bodies[0].placement.position_m = {0, 0.02, 0};
  scene.bodies[0].material.young_modulus_pa = 2e5;
  scene.obstacles = {{}};
  scene.obstacles[0].name = "table";
  return scene;
}

Vec3d sum_N_s(const std::vector<BodyPointContact>& contacts) {
  Vec3d sum{};
  for (const BodyPointContact& c : contacts) sum += vec_cast<double>(c.impulse_N_s);
  return sum;
}

class PointContacts : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(PointContacts);

/// A block that rests gets its weight. After a second its swing has faded below rounding: a point's impulse
/// is a sum over the substeps of a frame in float, each with an error of 2^-24 of the sum. So is the block's
/// mass, a sum of products. One rounding more is that of weights, which add up to 1.
TEST_P(PointContacts, OfABlockAtRestBearItsWeight) {
  DeviceSet devices(GetParam());
  test::FilmedWorld simulation(devices, block_on_table(), {}, {});
  simulation.report_contacts("block");
  constexpr int kRests = 50, kFrames = 75;
  double normal_N_s = 0, momentum_y = 0;
  int substeps = 0;
  std::map<Index, std::pair<double, double>> of_point;  // normal, tangential since the beginning
  for (int f = 0; f <= kFrames; ++f) {
    substeps = std::max(substeps, simulation.step(nullptr, f > 0 ? kFrame_s : 0).substeps);
    if (f == kRests) momentum_y = simulation.monitors()[0].momentum_kg_m_s.y;
    for (const BodyPointContact& c : simulation.contacts("block")) {
      ASSERT_EQ(c.other, "table");
      ASSERT_EQ(c.kind, ColliderKind::obstacle);
      ASSERT_GE(c.point, 0);
      ASSERT_EQ(c.normal, (Vec3f{0, 1, 0}));
      ASSERT_LE(c.gap_m, 0);
      ASSERT_LT(std::abs(c.point_m.y), 1e-4F) << "corrections put points on the table";
      auto& [normal, tangential] = of_point[c.point];
      normal += double{c.normal_N_s};
      tangential += double{length(c.tangential_N_s)};
      if (f > kRests) normal_N_s += double{c.normal_N_s};
    }
  }
  ASSERT_GE(of_point.size(), 25U) << "half a spacing apart on 4 x 4 cubes";
  const double weight_N_s = kMass_kg * 9.81 * (kFrames - kRests) * kFrame_s;
  const double rounding = (substeps + 2) * std::pow(2.0, -24);
  EXPECT_NEAR(normal_N_s / weight_N_s, 1, rounding);
  const double gained = simulation.monitors()[0].momentum_kg_m_s.y - momentum_y;
  EXPECT_LT(std::abs(gained) / weight_N_s, rounding);
  for (const auto& [point, impulses] : of_point)
    EXPECT_LE(impulses.second, 0.5 * impulses.first * (1 + 1e-5)) << "point " << point;
}

/// Normals are radii of the ball: its mesh has squares of 1/16 of a quarter turn, so faces lean by up to
/// 0.07 to 0.09 rad at their corners, and cos 0.09 = 0.996.
///
/// In frame 3 the ball's way is first deeper than the block's face, by 1 mm: in a circle of sqrt(2 x 10 x 1)
/// = 4.5 mm. Points are 5 mm apart, so a circle of more than 5 / sqrt(2) = 3.5 mm holds one. The block is
/// free: all that the contacts give it is its momentum, to the roundings of sums in float. It leaves the ball
/// faster than the ball goes after it, and not faster than from an elastic blow, twice that.
TEST_P(PointContacts, OfAPressedBallAreWhereItsSurfaceIs) {
  DeviceSet devices(GetParam());
  Scene scene = ball_and_block();
  test::FilmedWorld asked(devices, scene, {}, {}), silent(devices, scene, {}, {});
  asked.report_contacts("block");
  constexpr double kBall_m_s = 0.1;
  std::map<int, std::size_t> seen;  // per frame
  Vec3d given_N_s{};
  int substeps = 0;
  for (int f = 0; f <= 25; ++f) {
    const Vec3d center_m = {0, 0.035 - kBall_m_s * kFrame_s * f, 0};
    for (test::FilmedWorld* simulation : {&asked, &silent})
      simulation->set_pose("ball", {Mat3d::identity(), center_m});
    const StepReport report = asked.step(nullptr, f > 0 ? kFrame_s : 0);
    silent.step(nullptr, f > 0 ? kFrame_s : 0);
    Vec3d on_ball{};
    for (const BodyContact& c : report.contacts) on_ball += vec_cast<double>(c.reaction.impulse_N_s);
    const auto& contacts = asked.contacts("block");
    substeps += report.substeps;
    given_N_s += sum_N_s(contacts);
    // Sums in units of 2^-40 N s on one side, of roundings by 6e-8 on the other.
    EXPECT_LE(length(sum_N_s(contacts) + on_ball), 1e-6 * length(on_ball) + 1e-10);
    for (const BodyPointContact& c : contacts) {
      EXPECT_EQ(c.other, "ball");
      if (c.point < 0 || c.state == TouchState::left) continue;
      ++seen[f];
      const Vec3d radius_m = vec_cast<double>(c.point_m) - center_m;
      EXPECT_NEAR(length(radius_m), 0.01, 1e-4);
      EXPECT_GT(dot(radius_m, vec_cast<double>(c.normal)) / length(radius_m), 0.995);
    }
  }
  ASSERT_FALSE(seen.empty());
  EXPECT_EQ(seen.begin()->first, 3);
  EXPECT_GE(seen.begin()->second, 1U);
  const Vec3d momentum = asked.monitors()[0].momentum_kg_m_s;
  EXPECT_LE(length(momentum - given_N_s), substeps * std::pow(2.0, -24) * length(momentum));
  EXPECT_GT(-momentum.y / kMass_kg, kBall_m_s);
  EXPECT_LT(-momentum.y / kMass_kg, 2 * kBall_m_s);
  EXPECT_TRUE(silent.contacts("block").empty());
  EXPECT_EQ(asked.bodies()[0]->positions_m(asked.context()),
            silent.bodies()[0]->positions_m(silent.context()))
      << "asking changes nothing";
}

/// Contacts of a bar that more than one device steps.
struct Played {
  std::vector<Vec3f> vectors;
  std::vector<Index> points;
  int slabs = 0;
};

Played play(const std::string& devices_text) {
  DeviceSet devices(devices_text);
  Scene scene = block_on_table();
  scene.bodies[0].shape.size_m = {0.04, 0.04, 0.32};
  test::FilmedWorld simulation(devices, scene, {}, {});
  simulation.report_contacts("block");
  Played played;
  for (int f = 0; f <= 5; ++f) {
    simulation.step(nullptr, f > 0 ? kFrame_s : 0);
    for (const BodyPointContact& c : simulation.contacts("block")) {
      played.vectors.insert(played.vectors.end(), {c.point_m, c.normal, c.impulse_N_s, c.tangential_N_s});
      played.points.push_back(c.point);
    }
  }
  played.slabs = simulation.bodies()[0]->tissue().slab_count();
  return played;
}

TEST_P(PointContacts, HaveTheSameBitsOnManyDevices) {
  static const Played expected = play("cpu");
  const Played got = play(GetParam());
  EXPECT_FALSE(expected.points.empty());
  EXPECT_EQ(got.points, expected.points);
  EXPECT_TRUE(got.vectors == expected.vectors);
  EXPECT_EQ(got.slabs > 1, GetParam() == "cpu:2" || GetParam() == "cpu:3");
}

/// One sum per other body, with opposite signs.
TEST(PointContactsOfBodies, AreOneSumEach) {
  DeviceSet devices("cpu");
  Scene scene = block_on_table();
  BodyDescription& upper = scene.bodies.emplace_back(scene.bodies[0]);
  upper.name = "upper";
  upper.placement.position_m = {0, 0.0605, 0};
  test::FilmedWorld simulation(devices, scene, {}, {});
  for (const char* name : {"block", "upper"}) simulation.report_contacts(name);
  int touched = 0;
  for (int f = 0; f <= 10; ++f) {
    simulation.step(nullptr, f > 0 ? kFrame_s : 0);
    Vec3f on_block{}, on_upper{};
    for (const BodyPointContact& c : simulation.contacts("block"))
      if (c.other == "upper") on_block += c.impulse_N_s;
    for (const BodyPointContact& c : simulation.contacts("upper")) {
      EXPECT_EQ(c.other, "block");
      EXPECT_EQ(c.kind, ColliderKind::body);
      EXPECT_EQ(c.point, -1);
      on_upper += c.impulse_N_s;
    }
    EXPECT_EQ(on_block, -on_upper);
    touched += on_upper.y > 0 ? 1 : 0;
  }
  EXPECT_GT(touched, 3);
}

TEST(PointContactsOfBodies, RefuseWrongNames) {
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, block_on_table(), {}, {});
  try {
    simulation.report_contacts("blok");
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "'blok' is no body; those are 'block'");
  }
}

}  // namespace
}  // namespace tactus
