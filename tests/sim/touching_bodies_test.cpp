// Scenes whose bodies touch one another.
#include "tactus/sim/body/touching_bodies.h"
#include "support/filmed_world.h"

#include <gtest/gtest.h>

#include "support/data_folder.h"
#include "support/device_sets.h"
#include "support/synthetic_frame.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

class TouchingBodiesOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(TouchingBodiesOnDevices);

BodyDescription block(const char* name, double spacing_m, double bottom_m, TissueModel model) {
  BodyDescription body;
  body.material.half_width = 2;
  body.name = name;
  body.shape.size_m = {0.2, 0.1, 0.2};
  body.placement.position_m = {0, bottom_m + 0.05, 0};
  body.spacing_m = spacing_m;
  body.material.model = model;
  body.material.young_modulus_pa = 20000;
  body.material.poisson_ratio = 0.3;
  body.material.density_kg_m3 = 300;
  body.material.damping = 0.7;
  body.material.drag_per_s = 5;
  return body;
}

/// A floor; on it a block of elements; on that a hybrid one of other spacing, whose shape matching goes two
/// substeps at once; and above a block of shape matching that falls.
Scene stack_scene() {
  Scene scene;
  scene.reconstruction.resolution = 24;
  scene.bodies = {block("low", 0.05, 0.01, TissueModel::tled),
                  block("middle", 0.04, 0.12, TissueModel::hybrid),
                  block("high", 0.05, 0.23, TissueModel::flsm)};
  scene.bodies[1].ratio = RatioDescription{};
  scene.bodies[1].matching_every = 2;
  scene.bodies[1].placement.rotation_deg = {0, 30, 0};
  ObstacleSetting floor;
  floor.name = "floor";
  scene.obstacles.push_back(floor);
  return scene;
}

struct Result {
  std::vector<std::vector<Vec3f>> surfaces;
  std::vector<double> weight_N;  ///< of the lattices, whose boundary cubes are filled in part
  StepReport report;
};

Result play(const std::string& devices_text, const Scene& scene, int frames) {
  DeviceSet devices(devices_text, 5);
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  Result result;
  for (int k = 0; k <= frames; ++k) result.report = simulation.step(nullptr, k == 0 ? 0 : 1.0 / 30);
  for (const TriangleMesh& mesh : simulation.snapshot().bodies) result.surfaces.push_back(mesh.positions_m);
  for (const auto& body : simulation.bodies())
    result.weight_N.push_back(9.81 * body->shape().lattice.mass_kg());
  return result;
}

const BodyContact* find(const StepReport& report, const std::string& body, const std::string& component) {
  for (const BodyContact& c : report.contacts) {
    if (c.body == body && c.component == component) return &c;
  }
  return nullptr;
}

TEST_P(TouchingBodiesOnDevices, AStackRestsAndItsForcesAreWeights) {
  static const Result on_cpu = play("cpu", stack_scene(), 45);
  const Result got = play(GetParam(), stack_scene(), 45);
  ASSERT_EQ(got.report.contacts.size(), 5U);
  const double high_N = got.weight_N[2], middle_N = high_N + got.weight_N[1],
               low_N = middle_N + got.weight_N[0];
  // What still swings after 1.5 s is the tolerance; the sum over a frame balances momentum to rounding
  // (BodyPairs.ReactionsAreWeightsAndOpposite).
  const auto down_N = [&](const char* body, const char* component) {
    const BodyContact* c = find(got.report, body, component);
    EXPECT_NE(c, nullptr) << body << " on " << component;
    return c == nullptr ? 0 : static_cast<double>(-c->reaction.force_N.y);
  };
  EXPECT_NEAR(down_N("high", "middle"), high_N, 0.03 * high_N);
  EXPECT_EQ(down_N("middle", "high"), -down_N("high", "middle"));
  EXPECT_NEAR(down_N("middle", "low"), middle_N, 0.03 * middle_N);
  EXPECT_NEAR(down_N("low", "floor"), low_N, 0.03 * low_N);
  EXPECT_EQ(got.report.contact.force_N, Vec3f{}) << "none of them is real";
  EXPECT_EQ(got.surfaces, on_cpu.surfaces);
}

/// With `contact: false` for one, or `contact.bodies: false` for all, they pass through one another.
TEST(TouchingBodies, OnlyWhereTheSceneSaysSo) {
  Scene scene = stack_scene();
  scene.bodies.resize(2);
  scene.bodies[0].fixed.push_back({});
  scene.bodies[0].fixed[0].where.kind = RegionKind::half_space;
  scene.obstacles.clear();
  const auto lowest = [](const Result& r) {
    float low = 1;
    for (const Vec3f& p : r.surfaces[1]) low = std::min(low, p.y);
    return low;
  };
  EXPECT_GT(lowest(play("cpu", scene, 15)), 0.08F);
  Scene off = scene;
  off.contact.bodies = false;
  EXPECT_LT(lowest(play("cpu", off, 15)), -0.2F);
  off = scene;
  off.bodies[0].contact = false;
  EXPECT_LT(lowest(play("cpu", off, 15)), -0.2F);
}

TEST(TouchingBodies, OverlapAtRestIsNamed) {
  Scene scene = stack_scene();
  scene.bodies.resize(2);
  const auto warnings = [&] {
    testing::internal::CaptureStderr();
    DeviceSet devices("cpu");
    const test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(warnings().find("overlap"), std::string::npos);
  scene.bodies[1].placement.position_m.y = 0.13;  // 3 cm into the lower one
  const std::string text = warnings();
  EXPECT_NE(text.find("bodies 'low' and 'middle' overlap at rest by 0.03 m, most at ("), std::string::npos)
      << text;
  EXPECT_NE(text.find("'contact.bodies: false'"), std::string::npos) << text;
  scene.contact.bodies = false;
  EXPECT_NE(warnings().find("they don't touch one another"), std::string::npos);
}

/// A stack on corrections in every second substep lies lower by what it goes in more: less than a twentieth
/// of a spacing for each contact below.
TEST(TouchingBodies, AStackStandsOnSeldomCorrections) {
  const auto heights_m = [](int every) {
    Scene scene = stack_scene();
    scene.contact.every = every;
    const Result r = play("cpu", scene, 45);
    EXPECT_EQ(r.report.substeps % every, 0);
    std::vector<double> low_m;
    for (const std::vector<Vec3f>& surface : r.surfaces) {
      float low = 1;
      for (const Vec3f& p : surface) low = std::min(low, p.y);
      low_m.push_back(double{low});
    }
    return low_m;
  };
  const std::vector<double> often = heights_m(1), seldom = heights_m(2);
  for (std::size_t b = 1; b < often.size(); ++b) {
    EXPECT_GT(often[b], seldom[b]);
    EXPECT_NEAR(seldom[b], often[b], 0.05 * 0.05 * static_cast<double>(b)) << b;
  }
}

/// What falls at 3 m/s goes in by less than a spacing before it is corrected, so it stays above what it falls
/// on, which is two spacings thick.
TEST(TouchingBodies, WhatFallsQuicklyIsCaughtBySeldomCorrections) {
  Scene scene = stack_scene();
  scene.contact.every = 2;
  scene.bodies.resize(2);
  scene.bodies[0].fixed.push_back({});
  scene.bodies[0].fixed[0].where.kind = RegionKind::half_space;
  scene.bodies[1].material.drag_per_s = 0;
  scene.bodies[1].placement.position_m.y = 0.6;
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  double fastest_m_s = 0, lowest_m = 2;
  for (int k = 0; k <= 30; ++k) {
    const StepReport report = simulation.step(nullptr, k == 0 ? 0 : 1.0 / 30);
    EXPECT_TRUE(report.notices.empty()) << text_of(report.notices);
    fastest_m_s = std::max(fastest_m_s, double{simulation.bodies()[1]->status().fastest_m_s()});
    if (k > 0) lowest_m = std::min(lowest_m, simulation.bodies()[1]->status().motion.center_m.y);
  }
  EXPECT_GT(fastest_m_s, 2.9);
  EXPECT_GT(lowest_m, 0.11) << "its middle was in the lower one";
}

TEST(TouchingBodies, SubstepsThatCorrectionsDontDivideAreNamed) {
  Scene scene = stack_scene();
  scene.contact.every = 4;
  scene.frame.substeps = 6;
  DeviceSet devices("cpu");
  try {
    const test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
    FAIL() << "not refused";
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()), "'frame.substeps' is 6, expected a multiple of 'contact.every', 4");
  }
}

/// What overlaps at the start is pressed apart, and nothing blows up.
/// Two cubes come to rest, one on the other, before the first frame: no notice says otherwise, and the lower
/// one bears what the upper one weighs, 9.81 N, which it gets from the box below with its own weight. The
/// force that settling leaves is 1e-3 of the loads, and contact adds some points' rattle: 1 %.
TEST(TouchingBodies, TwoSettleOneOnTheOther) {
  const Scene scene = parse_scene(R"(
source: {kind: none}
frame: {start: settled}
bodies:
  - name: lower
    shape: {kind: box, size_m: [0.1, 0.1, 0.1]}
    placement: {position_m: [0, 0.05, 0]}
    spacing_m: 0.02
    material: {model: tled, young_modulus_pa: 100000}
  - name: upper
    shape: {kind: box, size_m: [0.1, 0.1, 0.1]}
    placement: {position_m: [0, 0.15, 0]}
    spacing_m: 0.02
    material: {model: tled, young_modulus_pa: 100000}
obstacles:
  - {name: floor, kind: box, size_m: [2, 0.2, 2], placement: {position_m: [0, -0.1, 0]}}
)",
                                  "scenes/x.yaml");
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, {}, {});
  StepReport report;
  for (int k = 0; k < 3; ++k) {
    report = simulation.step(nullptr, k == 0 ? 0 : 1.0 / 30);
    for (const Notice& n : report.notices) ADD_FAILURE() << "frame " << k << ": " << n.message();
  }
  const BodyContact* upper = find(report, "upper", "lower");
  ASSERT_NE(upper, nullptr);
  EXPECT_NEAR(double{-upper->reaction.force_N.y}, 9.81, 0.01 * 9.81);
}

TEST(TouchingBodies, WhatOverlapsComesApart) {
  Scene scene = stack_scene();
  scene.bodies.resize(2);
  scene.bodies[1].placement.position_m.y = 0.13;
  const Result r = play("cpu", scene, 60);
  EXPECT_TRUE(r.report.notices.empty());
  float low = 1, high = 0;
  for (const Vec3f& p : r.surfaces[1]) low = std::min(low, p.y);
  for (const Vec3f& p : r.surfaces[0]) high = std::max(high, p.y);
  EXPECT_GT(low, high - 0.25F * 0.04F);
}

/// The scene of the page on contact, without its hand: the pile settles, each on the one below.
TEST(TouchingBodies, ThePileOfTheExampleStands) {
  Scene scene = read_scene(source_path("scenes/stack.yaml"));
  scene.reconstruction.resolution = 24;
  const Result r = play("cpu", scene, 30);
  EXPECT_TRUE(r.report.notices.empty());
  const auto presses = [&](const char* body, const char* component) {
    const BodyContact* c = find(r.report, body, component);
    return c != nullptr && c->reaction.force_N.y < 0;
  };
  EXPECT_TRUE(presses("high", "middle"));
  EXPECT_TRUE(presses("middle", "low"));
  EXPECT_TRUE(presses("low", "floor"));
  EXPECT_EQ(r.report.contacts.size(), 5U) << "nobody else touches";
}

}  // namespace
}  // namespace tactus
