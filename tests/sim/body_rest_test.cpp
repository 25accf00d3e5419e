// Bodies of every model on obstacles: they rest on them, stand and slide as Coulomb says, and pass through
// nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

constexpr double kEdge = 0.1, kGravity = 9.81, kDegree = 3.14159265358979 / 180;

TriangleMesh box_mesh(Vec3f half) {
  TriangleMesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.positions_m.push_back(
        {(k & 1) != 0 ? half.x : -half.x, (k & 2) != 0 ? half.y : -half.y, (k & 4) != 0 ? half.z : -half.z});
  constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& f : kFaces) {
    mesh.triangles.push_back({f[0], f[1], f[2]});
    mesh.triangles.push_back({f[0], f[2], f[3]});
  }
  return mesh;
}

/// Half of the stress of a step fades within 10 ms, so what sways at 10 to 50 Hz loses energy, as tissue
/// does. `young_Pa` is what lasts.
constexpr double kFading = 0.5, kFadingTime_s = 0.01;

/// A tray that is a mesh is 60 cm long on the level, the others 4 m.
struct Case {
  TissueModel model = TissueModel::flsm;
  double spacing_m = 0.02, fps = 30;
  ObstacleShape kind = ObstacleShape::box;
  double thick_m = 0.02, drop_m = 5e-4, young_Pa = 1e5, damping = 0.5, slope_deg = 0;
  int cubes = 1;
  double flat = 1;       ///< height over edge
  bool lossy = false;    ///< elements that lose energy as they sway
  bool leaning = false;  ///< tray and cubes lean by the slope, not gravity
  bool settled = false;  ///< at the start
};

/// Cubes of 10 cm, one above the other, over a tray whose top is y = 0. Gravity leans by the slope, or all
/// else.
class OnATray {
 public:
  explicit OnATray(const Case& c, const std::string& devices_text = "cpu")
      : case_(c),
        devices_(devices_text, 5),
        simulation_(devices_, scene(c), make_synthetic_rig(), assets(c)) {
    step(0);
  }
  /// @returns the codes of notices
  std::string run(double seconds) {
    std::string codes;
    for (int k = 0, n = static_cast<int>(std::lround(seconds * case_.fps)); k < n; ++k) {
      codes += step(1 / case_.fps);
      for (const auto& body : simulation_.bodies())
        lowest_m_ = std::min(lowest_m_, body->status().motion.center_m.y);
    }
    return codes;
  }
  const RigidMotion& motion(std::size_t body = 0) const {
    return simulation_.bodies()[body]->status().motion;
  }
  double lowest_center_m() const { return lowest_m_; }
  /// Of a vector, down the slope.
  double down_slope(Vec3d v) const { return dot(v, turn(case_) * Vec3d{1, 0, 0}) * (case_.leaning ? -1 : 1); }
  std::vector<Vec3f> surface() { return simulation_.snapshot().bodies.at(0).positions_m; }
  /// Bottom and top.
  std::pair<double, double> height_m() {
    double low = 9, high = -9;
    for (const Vec3f& p : surface()) low = std::min(low, double{p.y}), high = std::max(high, double{p.y});
    return {low, high};
  }

 private:
  static Mat3d turn(const Case& c) {
    PlacementDescription placement;
    placement.rotation_deg = {0, 0, c.leaning ? c.slope_deg : 0};
    return placement.rotation();
  }
  static void lean(const Case& c, PlacementDescription& placement) {
    placement.position_m = turn(c) * placement.position_m;
    placement.rotation_deg = {0, 0, c.leaning ? c.slope_deg : 0};
  }
  static Scene scene(const Case& c) {
    Scene scene;
    scene.reconstruction.resolution = 12;
    if (c.settled) scene.frame.start = FrameStart::settled;
    for (int b = 0; b < c.cubes; ++b) {
      BodyDescription& body = scene.bodies.emplace_back();
      body.name = "cube " + std::to_string(b);
      body.shape.size_m = {kEdge, c.flat * kEdge, kEdge};
      body.placement.position_m = {0, 0.5 * c.flat * kEdge + c.drop_m + b * (kEdge + 5e-4), 0};
      body.spacing_m = c.spacing_m;
      body.material.model = c.model;
      body.material.half_width = 1;
      body.material.young_modulus_pa = c.young_Pa;
      body.material.damping = c.damping;
      if (c.lossy) {
        body.material.young_modulus_pa = c.young_Pa / (1 - kFading);
        body.material.relaxation = {{.share = kFading, .time_s = kFadingTime_s}};
      }
      lean(c, body.placement);
      if (c.model == TissueModel::hybrid) body.ratio = RatioDescription{};
    }
    const double slope = c.leaning ? 0 : c.slope_deg * kDegree;
    scene.gravity_m_s2 = {kGravity * std::sin(slope), -kGravity * std::cos(slope), 0};
    ObstacleSetting& tray = scene.obstacles.emplace_back();
    tray.name = "tray";
    tray.kind = c.kind;
    tray.size_m = {4, c.thick_m, 1};
    tray.placement.position_m = {0, c.kind == ObstacleShape::plane ? 0 : -0.5 * c.thick_m, 0};
    lean(c, tray.placement);
    return scene;
  }
  static BodyAssets assets(const Case& c) {
    BodyAssets assets;
    if (c.kind == ObstacleShape::mesh)
      assets.obstacle_meshes["tray"] =
          box_mesh({c.slope_deg > 0 ? 3.F : 0.3F, static_cast<float>(0.5 * c.thick_m), 0.2F});
    return assets;
  }
  std::string step(double dt_s) {
    std::string codes;
    for (const Notice& notice : simulation_.step(nullptr, dt_s).notices) codes += notice.code + " ";
    return codes;
  }

  Case case_;
  DeviceSet devices_;
  test::FilmedWorld simulation_;
  double lowest_m_ = 9;
};

#define SKIP_UNLESS_LONG()                         \
  if (std::getenv("TACTUS_LONG_TESTS") == nullptr) \
  GTEST_SKIP() << "seconds, in which fine lattices meet triangles: set TACTUS_LONG_TESTS=1"

class BodyRests : public ::testing::TestWithParam<Case> {};
/// Every model and spacing on every kind of tray, and at every rate on a mesh of 2 mm.
std::vector<Case> rest_cases() {
  std::vector<Case> all;
  for (const TissueModel model : {TissueModel::flsm, TissueModel::tled, TissueModel::hybrid}) {
    for (const double spacing_m : {0.02, 0.05}) {
      for (const ObstacleShape kind : {ObstacleShape::plane, ObstacleShape::box, ObstacleShape::mesh})
        all.push_back({.model = model, .spacing_m = spacing_m, .kind = kind, .thick_m = 0.002});
      for (const double fps : {10., 120.})
        all.push_back({.model = model,
                       .spacing_m = spacing_m,
                       .fps = fps,
                       .kind = ObstacleShape::mesh,
                       .thick_m = 0.002});
    }
  }
  return all;
}
INSTANTIATE_TEST_SUITE_P(Everywhere, BodyRests, ::testing::ValuesIn(rest_cases()));

/// Its bottom is at the tray's top, and its top lower than its edge by the squash of a column under its own
/// weight, ρ g h² / 2 E = 0.49 mm. Shape matching is softer where regions end, as those of a cube of five do:
/// half a percent of the edge. Where it is met between two corrections it is in by less than 0.2 mm.
TEST_P(BodyRests, OnTheTraysTop) {
  const Case& c = GetParam();
  if (c.model != TissueModel::flsm && c.spacing_m < 0.05 && c.fps < 30) SKIP_UNLESS_LONG();
  OnATray cube(c);
  EXPECT_EQ(cube.run(0.8), "");
  const auto [low, high] = cube.height_m();
  EXPECT_NEAR(low, 0, 2e-4);
  EXPECT_NEAR(high, kEdge - 1000 * kGravity * kEdge * kEdge / (2 * c.young_Pa), 0.005 * kEdge);
}

/// At 5 m/s, from 1.27 m, on 2 mm.
TEST_P(BodyRests, WhereItFallsOnATrayAtFiveMetresASecond) {
  Case c = GetParam();
  c.drop_m = 1.27;
  OnATray cube(c);
  EXPECT_EQ(cube.run(0.9), "");
  EXPECT_GT(cube.lowest_center_m(), 0.2 * kEdge);
}

/// All defaults of a scene with shape matching: E 10 kPa. It swings up and down on the tray by the squash of
/// 5 mm and more; nothing of it goes through.
TEST(SoftBodyRests, OnAThinTrayWithFewSubsteps) {
  for (const double thick_m : {0.02, 0.002}) {
    OnATray cube({.thick_m = thick_m, .young_Pa = 1e4, .damping = 0.1});
    EXPECT_EQ(cube.run(3), "");
    EXPECT_NEAR(cube.height_m().first, 0, 2e-3) << "a tenth of a spacing";
    EXPECT_GT(cube.lowest_center_m(), 0.35 * kEdge);
  }
}

/// E 10 kPa: its centre is at 0.045 to 0.050 m, as ρ g h² / E is 10 mm, a third of which the
/// centre of a column goes down, less what bulges.
TEST(SoftBodyRests, UnderItsOwnWeight) {
  for (const TissueModel model : {TissueModel::flsm, TissueModel::tled, TissueModel::hybrid}) {
    OnATray cube({.model = model, .young_Pa = 1e4});
    EXPECT_EQ(cube.run(2), "");
    EXPECT_GT(cube.motion().center_m.y, 0.045);
    EXPECT_LT(cube.motion().center_m.y, 0.050);
  }
}

/// A low block that loses energy as it sways: elements by what fades, others by `damping`.
Case low(TissueModel model, Case c = {}) {
  c.model = model, c.flat = 0.5;
  c.lossy = model == TissueModel::tled;
  c.damping = c.lossy ? 0.1 : 0.5;
  return c;
}
/// A cube of 10 kPa that is let go on a slope of 25 degrees has to be lifted by 4 mm to roll over, and
/// squashes by 5 to 10: what is softer is half as high here. What hardly loses energy flutters: see
/// docs/tissue_verification.md.
std::vector<Case> slope_cases() {
  std::vector<Case> all;
  for (const TissueModel model : {TissueModel::flsm, TissueModel::hybrid, TissueModel::tled}) {
    all.push_back({.model = model});
    if (model != TissueModel::tled)
      all.push_back({.model = model, .young_Pa = 1e4, .damping = 0.1, .flat = 0.5});
    all.push_back(low(model, {.young_Pa = 1e4}));
    all.push_back(low(model, {.spacing_m = 0.01, .young_Pa = 1e4}));
    all.push_back(low(model, {.kind = ObstacleShape::plane, .young_Pa = 1e5, .leaning = true}));
    all.push_back(low(model, {.kind = ObstacleShape::mesh, .young_Pa = 1e4, .leaning = true}));
  }
  return all;
}
class BodyOnASlope : public ::testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Models, BodyOnASlope, ::testing::ValuesIn(slope_cases()));

/// tan 20° < 0.4: it stands, once the blow of its first fall is over.
TEST_P(BodyOnASlope, StandsBelowTheAngleOfFriction) {
  Case c = GetParam();
  c.slope_deg = 20;
  OnATray cube(c);
  EXPECT_EQ(cube.run(2), "");
  const double before_m = cube.down_slope(cube.motion().center_m);
  EXPECT_EQ(cube.run(1), "");
  EXPECT_NEAR(cube.down_slope(cube.motion().center_m), before_m, 1e-4) << "0.1 mm/s";
}

/// tan 25° > 0.4: it slides with g (sin - mu cos).
TEST_P(BodyOnASlope, SlidesAboveTheAngleOfFriction) {
  Case c = GetParam();
  if (c.model != TissueModel::tled && c.kind == ObstacleShape::mesh) SKIP_UNLESS_LONG();
  c.slope_deg = 25;
  OnATray cube(c);
  cube.run(1);
  const double before_m_s = cube.down_slope(cube.motion().velocity_m_s);
  cube.run(1);
  const double slope = 25 * kDegree, expected = kGravity * (std::sin(slope) - 0.4 * std::cos(slope));
  EXPECT_NEAR(cube.down_slope(cube.motion().velocity_m_s) - before_m_s, expected, 0.03 * expected);
}

/// Of elements of 10 kPa. It sways by 0.2 mm for many seconds: that is averaged over a second.
TEST(SoftBodyRests, OnASlope) {
  OnATray cube({.model = TissueModel::tled, .young_Pa = 1e4, .slope_deg = 20});
  const auto mean_m = [&] {
    double sum = 0;
    for (int k = 0; k < 30; ++k) {
      EXPECT_EQ(cube.run(1. / 30), "");
      sum += cube.motion().center_m.x / 30;
    }
    return sum;
  };
  EXPECT_EQ(cube.run(3), "");
  const double before_m = mean_m();
  EXPECT_EQ(cube.run(2), "");
  EXPECT_NEAR(mean_m(), before_m, 3e-4) << "0.1 mm/s";
}

/// By statics, cubes of 10 kPa that stick tip between 25 and 30 degrees.
TEST(SoftBodyRests, OnASlopeWhereItBeginsSettled) {
  for (const double spacing_m : {0.01, 0.02}) {
    OnATray cube({.model = TissueModel::tled,
                  .spacing_m = spacing_m,
                  .drop_m = 0,
                  .young_Pa = 1e4,
                  .slope_deg = 20,
                  .settled = true});
    EXPECT_EQ(cube.run(1), "");
    const double before_m = cube.motion().center_m.x;
    EXPECT_EQ(cube.run(1), "");
    EXPECT_NEAR(cube.motion().center_m.x, before_m, 1e-4) << "0.1 mm/s";
  }
}

class StackOfFive : public ::testing::TestWithParam<TissueModel> {};
INSTANTIATE_TEST_SUITE_P(Models, StackOfFive, ::testing::Values(TissueModel::flsm, TissueModel::tled));

/// Each is above the one below by its edge, less what those above squash: (k + 1/2) ρ g h² / E with k of
/// them. A column of half a metre buckles below E = 0.2 MPa.
TEST_P(StackOfFive, Stands) {
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  OnATray stack({.model = GetParam(), .spacing_m = is_long ? 0.02 : 0.05, .young_Pa = 5e5, .cubes = 5});
  EXPECT_EQ(stack.run(is_long ? 60 : 5), "");
  for (std::size_t b = 1; b < 5; ++b) {
    const Vec3d apart = stack.motion(b).center_m - stack.motion(b - 1).center_m;
    EXPECT_NEAR(apart.y, kEdge, 0.03 * kEdge) << b;
    EXPECT_NEAR(stack.motion(b).center_m.x, 0, 0.1 * kEdge) << b;
    EXPECT_NEAR(stack.motion(b).center_m.z, 0, 0.1 * kEdge) << b;
  }
}

class BodyRestsOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(BodyRestsOn);

TEST_P(BodyRestsOn, TheSameBits) {
  const auto fall = [](const std::string& devices) {
    OnATray cube({.kind = ObstacleShape::mesh, .thick_m = 0.002, .drop_m = 0.05, .young_Pa = 1e4}, devices);
    cube.run(0.4);
    return cube.surface();
  };
  static const std::vector<Vec3f> on_cpu = fall("cpu");
  EXPECT_EQ(fall(GetParam()), on_cpu);
}

/// Of each obstacle once, however fast the centre goes through it.
TEST(ObstacleWatch, TellsOnceOfACentreThatWentThrough) {
  ObstacleDescription box, mesh, plane;
  box.name = "box", box.kind = ObstacleKind::box, box.half_m = {1, 0.001F, 1};
  mesh.name = "mesh", mesh.kind = ObstacleKind::mesh, mesh.mesh = box_mesh({1, 0.001F, 1});
  mesh.T_world_obstacle.t = {0, -1, 0};
  plane.name = "plane", plane.T_world_obstacle.t = {0, -2, 0};
  ObstacleWatch watch({box, mesh, plane});
  const auto all_round = [] { return box_mesh({9, 9, 9}); };
  const auto follow = [&](const char* body, Vec3d center_m) {
    return watch.follow(body, center_m, all_round);
  };
  EXPECT_EQ(follow("b", {0.1, 0.5, 0.2}), "");
  EXPECT_EQ(follow("b", {0.1, 0.1, 0.2}), "");
  EXPECT_NE(follow("b", {0.1, -0.1, 0.2}).find("obstacle 'box'"), std::string::npos);
  EXPECT_EQ(follow("b", {0.1, 0.1, 0.2}), "") << "once";
  EXPECT_EQ(follow("b", {0.1, -0.9, 0.2}), "");
  EXPECT_NE(follow("b", {0.1, -1.1, 0.2}).find("obstacle 'mesh'"), std::string::npos);
  EXPECT_NE(follow("b", {0.1, -2.1, 0.2}).find("obstacle 'plane'"), std::string::npos);
  EXPECT_EQ(follow("c", {3, 0.1, 0}), "");
  EXPECT_EQ(follow("c", {3, -1.5, 0}), "") << "beside both";

  // The centre of what lies round it is in no material of its own.
  const auto elsewhere = [] {
    TriangleMesh ring = box_mesh({1, 1, 1});
    for (Vec3f& p : ring.positions_m) p.x += 5;
    return ring;
  };
  EXPECT_EQ(watch.follow("ring", {0, 0.1, 0}, elsewhere), "");
  EXPECT_EQ(watch.follow("ring", {0, 0, 0}, elsewhere), "");
}

}  // namespace
}  // namespace tactus
