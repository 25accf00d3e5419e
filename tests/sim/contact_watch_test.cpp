// What users are told of bodies that gain energy, or that are inside of other things; and that nothing passes
// through bodies and the real surface at 5 m/s.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "support/filmed_world.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

constexpr double kGravity = 9.81;

BodyDescription block(const std::string& name, Vec3d size_m, Vec3d at_m,
                      TissueModel model = TissueModel::tled) {
  BodyDescription body;
  body.name = name;
  body.shape.size_m = size_m;
  body.placement.position_m = at_m;
  body.material.model = model;
  body.material.young_modulus_pa = 1e5;
  if (model == TissueModel::hybrid) body.ratio = RatioDescription{};
  return body;
}

SpaceRegion half_space(Vec3d point_m, Vec3d normal) {
  SpaceRegion region;
  region.kind = RegionKind::half_space;
  region.point_m = point_m;
  region.normal = normal;
  return region;
}

Scene small_scene() {
  Scene scene;
  scene.reconstruction.resolution = 12;
  return scene;
}

ObstacleSetting floor_at(double y_m) {
  ObstacleSetting floor;
  floor.name = "floor";
  floor.placement.position_m = {0, y_m, 0};
  return floor;
}

// Energy

EnergyWatch::Body falling(double time_s, double speed_up_m_s = 0) {
  const double v = speed_up_m_s - kGravity * time_s;
  return {"stone", 2, 0.02, {0, 1 + speed_up_m_s * time_s - 0.5 * kGravity * time_s * time_s, 0}, v * v};
}

/// Of 2 kg that fall, energy is constant: m v^2 / 2 = m g h. What rises at 0.1 m/s at the begin has gained
/// 0.01 J; 0.1 cubes and the half step before allow 0.04 J, and 1 m/s is 1 J.
TEST(EnergyWatch, TellsOnceOfWhatNothingGave) {
  EnergyWatch still({falling(0)}, {0, -kGravity, 0}), pushed = still, shot = still;
  for (int k = 1; k <= 10; ++k) {
    const double time_s = k / 30.;
    EXPECT_EQ(still.follow(std::vector{falling(time_s)}, 1e-3), "");
    EXPECT_EQ(pushed.follow(std::vector{falling(time_s, 0.1)}, 1e-3), "");
    const std::string text = shot.follow(std::vector{falling(time_s, 1)}, 1e-3);
    EXPECT_EQ(text.find("body 'stone' gained most of 1 J") == 0, k == 1) << text;
  }
  EXPECT_TRUE(still.is_on());
  EXPECT_FALSE(shot.is_on());
}

/// The energy of all counts: one gives it to the other.
TEST(EnergyWatch, LetsBodiesPassItOn) {
  const auto with = [](double fell_m, double kinetic_J) {
    return EnergyWatch::Body{"b", 1, 0.02, {0, -fell_m, 0}, kinetic_J};
  };
  EnergyWatch watch({with(0, 0), with(0, 0)}, {0, -kGravity, 0});
  EXPECT_EQ(watch.follow(std::vector{with(1, 0), with(0, 9.8)}, 1e-3), "");
  EXPECT_NE(watch.follow(std::vector{with(1, 0), with(0, 12)}, 1e-3), "");
}

std::string codes_of(test::FilmedWorld& simulation, int frames, double fps = 30) {
  std::string codes;
  for (int k = 0; k < frames; ++k)
    for (const Notice& notice : simulation.step(nullptr, k == 0 ? 0 : 1 / fps).notices)
      codes += notice.code + " ";
  return codes;
}

/// A cube that falls, bounces and rests is silent; one whose nodes get 1 m/s is told of.
TEST(EnergyWatch, FollowsTheBodiesOfAScene) {
  for (const TissueModel model : {TissueModel::flsm, TissueModel::tled}) {
    Scene scene = small_scene();
    scene.bodies = {block("cube", {0.1, 0.1, 0.1}, {0, 0.3, 0}, model)};
    scene.obstacles = {floor_at(0)};
    DeviceSet devices("cpu");
    test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
    EXPECT_EQ(codes_of(simulation, 60), "");
    SoftBody& cube = *simulation.bodies()[0];
    std::vector<Vec3f> v_m_s = cube.velocities_m_s(simulation.context());
    for (Vec3f& v : v_m_s) v -= Vec3f{0, -3, 0};
    cube.set_nodes(cube.positions_m(simulation.context()), v_m_s);
    EXPECT_EQ(codes_of(simulation, 3), "body.gains_energy ");
  }
}

// Bodies over the box of a liquid

/// What the first frame tells of body 'cube', whose middle is at y: "" or the notice, with its remedy.
std::string no_floor(Scene scene, double y_m = 0.3) {
  scene.bodies.insert(scene.bodies.begin(), block("cube", {0.1, 0.1, 0.1}, {0, y_m, 0}));
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  std::string told;
  for (int k = 0; k < 2; ++k)
    for (const Notice& notice : simulation.step(nullptr, k / 30.).notices)
      if (notice.code == "body.no_floor") told += notice.text + "; " + notice.remedy + "\n";
  return told;
}

Scene over_liquid() {
  Scene scene = small_scene();
  LiquidDescription& liquid = scene.fluid.emplace();
  liquid.spacing_m = 0.04;
  liquid.density_kg_m3 = 900;
  liquid.box = {{-0.2, 0, -0.3}, {0.2, 1, 0.3}};
  return scene;
}

/// A notice names the obstacle that would do, and with that obstacle there is none, nor a fall.
TEST(BodyOverLiquid, IsToldOnceWithTheObstacleThatHoldsIt) {
  Scene scene = over_liquid();
  EXPECT_EQ(no_floor(scene),
            "body 'cube' is over 'fluid.box', whose faces hold the liquid alone: it will fall through the "
            "floor; hold it with 'fixed', or give 'obstacles' a floor: {name: floor, kind: box, size_m: "
            "[0.4, 0.08, 0.6], placement: {position_m: [0, -0.04, 0]}}\n");
  ObstacleSetting& floor = scene.obstacles.emplace_back();
  floor.name = "floor";
  floor.kind = ObstacleShape::box;
  floor.size_m = {0.4, 0.08, 0.6};
  floor.placement.position_m = {0, -0.04, 0};
  EXPECT_EQ(no_floor(scene), "");
  DeviceSet devices("cpu");
  Scene falls = scene;
  falls.bodies = {block("cube", {0.1, 0.1, 0.1}, {0, 0.1, 0})};
  test::FilmedWorld simulation(devices, falls, make_synthetic_rig(), {});
  EXPECT_EQ(codes_of(simulation, 30), "");
  EXPECT_GT(simulation.bodies()[0]->status().motion.center_m.y, 0.04);
  scene.obstacles[0].placement.position_m.x = 0.5;  // beside it
  EXPECT_NE(no_floor(scene), "");
  scene.obstacles[0].motion = {{}, {}};
  scene.obstacles[0].motion[1].time_s = 1;
  EXPECT_EQ(no_floor(scene), "") << "it moves, and may catch it";
}

/// Other bodies, planes and held regions bear it; gravity may be absent or have another direction.
TEST(BodyOverLiquid, IsBorneByWhatIsUnderIt) {
  Scene scene = over_liquid();
  EXPECT_NE(no_floor(scene, 0.06), "") << "in the box";
  EXPECT_EQ(no_floor(scene, -0.3), "") << "under the box";
  scene.gravity_m_s2 = {};
  EXPECT_EQ(no_floor(scene), "");
  scene.gravity_m_s2 = {-9.81, 0, 0};
  EXPECT_NE(no_floor(scene).find("size_m: [0.08, 1, 0.6], placement: {position_m: [-0.24, 0.5, 0]}"),
            std::string::npos);
  scene.gravity_m_s2 = {0, -9.81, 0};
  scene.obstacles = {floor_at(0)};
  EXPECT_EQ(no_floor(scene), "");
  scene.obstacles[0].placement.position_m.y = 2;
  EXPECT_NE(no_floor(scene), "") << "the plane is above it";
  scene.obstacles.clear();
  scene.bodies = {block("plate", {0.3, 0.04, 0.3}, {0, 0.1, 0})};
  EXPECT_NE(no_floor(scene).find("body 'plate'"), std::string::npos);
  EXPECT_EQ(no_floor(scene).find("body 'cube'"), std::string::npos) << "the plate takes it along";
  scene.bodies[0].fixed.push_back({half_space({-0.14, 0, 0}, {1, 0, 0})});
  EXPECT_EQ(no_floor(scene), "");
}

/// A cube of 1000 kg/m^3 goes (1000 / 1060) * 0.1 = 0.094 m deep in blood: a pool of 0.2 m by 0.4 m by 0.6 m
/// bears it, one of 0.04 m doesn't, nor a lighter liquid.
TEST(BodyOverLiquid, FloatsWhereThePoolIsDeepEnough) {
  Scene scene = over_liquid();
  LiquidDescription& liquid = *scene.fluid;
  liquid.density_kg_m3 = 1060;
  liquid.blocks = {{{{-0.2, 0, -0.3}, {0.2, 0.2, 0.3}}, {}}};
  EXPECT_EQ(no_floor(scene), "");
  liquid.density_kg_m3 = 990;
  EXPECT_NE(no_floor(scene), "");
  liquid.density_kg_m3 = 1060;
  liquid.blocks[0].box.max_m.y = 0.04;
  EXPECT_NE(no_floor(scene), "");
}

// Bodies in bodies

/// A small cube within a large one: contact of points finds nothing so deep.
TEST(BodyInABody, IsToldOnce) {
  Scene scene = small_scene();
  scene.gravity_m_s2 = {};
  scene.bodies = {block("large", {0.3, 0.3, 0.3}, {}), block("small", {0.06, 0.06, 0.06}, {})};
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  const std::string codes = codes_of(simulation, 25);
  int reported = 0;
  for (auto at = codes.find("body.in_body"); at != std::string::npos; at = codes.find("body.in_body", at + 1))
    ++reported;
  EXPECT_EQ(reported, 2) << "each in the other: " << codes;
}

/// A cube that is on one side in a frame, and on the other in the next.
TEST(BodyInABody, ThroughItWithinAFrameIsToldToo) {
  for (const double beside_m : {0.0, 0.25}) {
    Scene scene = small_scene();
    scene.gravity_m_s2 = {};
    scene.bodies = {block("large", {0.3, 0.3, 0.3}, {}),
                    block("small", {0.06, 0.06, 0.06}, {0.4, beside_m, 0})};
    DeviceSet devices("cpu");
    test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
    EXPECT_EQ(codes_of(simulation, 3), "");
    SoftBody& small = *simulation.bodies()[1];
    std::vector<Vec3f> x_m = small.positions_m(simulation.context());
    for (Vec3f& x : x_m) x.x -= 0.8F;
    small.set_nodes(x_m, std::vector<Vec3f>(x_m.size()));
    EXPECT_EQ(codes_of(simulation, 3).find("body.in_body") != std::string::npos, beside_m == 0);
  }
}

struct Fall {
  TissueModel model = TissueModel::flsm;
  double fps = 30, spacing_m = 0.02;
};
class FallsOnABody : public ::testing::TestWithParam<Fall> {};
std::vector<Fall> falls() {
  std::vector<Fall> all;
  for (const TissueModel model : {TissueModel::flsm, TissueModel::hybrid, TissueModel::tled})
    for (const double fps : {10., 30., 120.}) all.push_back({model, fps});
  all.push_back({TissueModel::flsm, 30, 0.01});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Models, FallsOnABody, ::testing::ValuesIn(falls()));

/// A block of 1 kg at 5 m/s, from 1.27 m, on a plate of two cubes that is held at two sides. Afterwards the
/// block is above the plate's middle by half its edge, less what both squash and what the plate bends round
/// it.
TEST_P(FallsOnABody, AtFiveMetresASecond) {
  const Fall& c = GetParam();
  if (c.spacing_m < 0.02 && std::getenv("TACTUS_LONG_TESTS") == nullptr)
    GTEST_SKIP() << "seconds of a fine lattice: set TACTUS_LONG_TESTS=1";
  Scene scene = small_scene();
  const double thick_m = 2 * c.spacing_m;
  scene.bodies = {block("block", {0.1, 0.1, 0.1}, {0, 0.05 + 25 / (2 * kGravity), 0}, c.model),
                  block("plate", {0.4, thick_m, 0.4}, {0, -0.5 * thick_m, 0}, c.model)};
  for (BodyDescription& body : scene.bodies) body.spacing_m = c.spacing_m;
  for (const double side : {-1., 1.})
    scene.bodies[1].fixed.push_back({half_space({side * (0.2 - 0.6 * c.spacing_m), 0, 0}, {-side, 0, 0})});
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  EXPECT_EQ(codes_of(simulation, static_cast<int>(1.5 * c.fps), c.fps), "");
  const FrameSnapshot seen = simulation.snapshot();
  const Vec3d center_m = simulation.bodies()[0]->status().motion.center_m;
  double plate_m = 0;
  int count = 0;
  for (const Vec3f& p : seen.bodies[1].positions_m) {
    if (std::hypot(double{p.x} - center_m.x, double{p.z} - center_m.z) > 0.04) continue;
    plate_m += double{p.y};
    ++count;
  }
  ASSERT_GT(count, 0);
  EXPECT_GT(center_m.y, plate_m / count + 0.025);
}

// The real surface

/// A cube in the middle of a ball of half a metre, where no surface is near.
TEST(BodyInTheRealSurface, IsTold) {
  Scene scene = small_scene();
  scene.reconstruction.resolution = 32;
  scene.gravity_m_s2 = {};
  scene.bodies = {block("cube", {0.1, 0.1, 0.1}, {0, 0.5, 0})};
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  std::string codes;
  for (int k = 0; k < 3; ++k) {
    FrameSet frame;
    SyntheticOptions options{.figure = "sphere", .depth = false, .truth = false};
    ASSERT_EQ(SyntheticSource(options).next(frame), NextFrame::success);
    for (const Notice& notice : simulation.step(frame, k == 0 ? 0 : 1. / 30).notices)
      codes += notice.code + " ";
  }
  EXPECT_EQ(codes, "body.in_surface ");
}

struct Hit {
  TissueModel model = TissueModel::flsm;
  double fps = 30, speed_m_s = 5;
};
class HitByABall : public ::testing::TestWithParam<Hit> {};
std::vector<Hit> hits() {
  std::vector<Hit> all;
  for (const TissueModel model : {TissueModel::flsm, TissueModel::hybrid, TissueModel::tled})
    for (const double fps : {10., 30., 120.}) all.push_back({model, fps});
  return all;
}
INSTANTIATE_TEST_SUITE_P(Models, HitByABall, ::testing::ValuesIn(hits()));

/// A ball that is seen anew in each frame strikes a free cube of 10 cm at 5 m/s. The cube takes on at least
/// the ball's speed and stays in front of it: its centre before the ball's lowest point.
TEST_P(HitByABall, FliesOffInFrontOfIt) {
  const Hit& c = GetParam();
  Scene scene = small_scene();
  scene.reconstruction.resolution = 48;
  scene.gravity_m_s2 = {};
  scene.bodies = {block("cube", {0.1, 0.1, 0.1}, {0, 0.3, 0}, c.model)};
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  SyntheticOptions options;
  options.figure = "sphere";
  options.shape.scale = 0.3F;
  options.depth = options.truth = false;
  std::string codes;
  const int before = c.fps > 60 ? 3 : 2;
  for (int k = 0; k < before + static_cast<int>(0.06 * c.fps) + 1; ++k) {
    // Without an offset the ball's lowest point is at 0.425 m; it meets the cube half a frame after `before`.
    const double above_m = c.speed_m_s / c.fps * (before - 0.5 - k);
    options.shape.offset_m = {0, static_cast<float>(0.35 - 0.425 + above_m), 0};
    FrameSet frame;
    ASSERT_EQ(SyntheticSource(options).next(frame), NextFrame::success);
    for (const Notice& notice : simulation.step(frame, k == 0 ? 0 : 1 / c.fps).notices)
      if (notice.code != "hull.check") codes += notice.code + " ";
  }
  EXPECT_EQ(codes, "");
  double lowest_m = 9;
  for (const Vec3f& p : simulation.snapshot().real.positions_m) lowest_m = std::min(lowest_m, double{p.y});
  EXPECT_LT(simulation.bodies()[0]->status().motion.center_m.y, lowest_m);
  EXPECT_LT(simulation.bodies()[0]->status().motion.velocity_m_s.y, -0.9 * c.speed_m_s);
}

}  // namespace
}  // namespace tactus
