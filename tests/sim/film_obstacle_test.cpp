/// A film on obstacles: puddles, slopes, its ledger with the particles', checkpoints, and the same bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <numeric>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/io/scene_file.h"
#include "tactus/sim/still_obstacles.h"

namespace tactus {
namespace {

/// A table whose upper side is at y = 0, 6 cm wide, and a slab of 1 ml of blood on it.
constexpr const char* kTable = R"(
source: {kind: none}
obstacles:
  - {name: table, kind: box, size_m: [0.06, 0.02, 0.06], placement: {position_m: [0, -0.01, 0]}}
fluid:
  spacing_m: 0.0025
  film: true
  max_particles: 5000
  box: {min_m: [-0.05, -0.05, -0.05], max_m: [0.05, 0.05, 0.05]}
  open: all
  blocks: [{min_m: [-0.01, 0, -0.01], max_m: [0.01001, 0.00251, 0.01001]}]
  viscosity_pa_s: 0.0035
  density_kg_m3: 1060
  surface_tension_n_m: 0.058
  contact_angle_deg: 40
  max_speed_m_s: 1
)";

Scene table() { return parse_scene(kTable, "scenes/x.yaml"); }

class WetTable {
 public:
  explicit WetTable(const Scene& scene, const std::string& devices = "cpu")
      : devices_(devices, 5),
        particle_m3_(std::pow(scene.fluid->spacing_m, 3)),
        world(devices_, scene, {}, {}) {}
  /// Checks the ledger, too.
  StepReport step() {
    StepReport report = world.step(nullptr, 1.0 / 60);
    const LiquidReport& l = report.liquid;
    const SceneFilmReport& film = report.film;
    const double due_m3 = particle_m3_ * (static_cast<double>(l.placed) + static_cast<double>(l.emitted) -
                                          static_cast<double>(film.given));
    const double left = static_cast<double>(l.taken) - static_cast<double>(film.taken) + l.replaced;
    EXPECT_NEAR(particle_m3_ * (l.here + left) + film.film_m3 + film.stain_m3, due_m3, 1e-6 * due_m3);
    return report;
  }
  std::string archived() {
    StateArchive a;
    world.archive(a, nullptr);
    return a.bytes();
  }
  void restore(const std::string& bytes) {
    StateArchive a(bytes, "f");
    world.archive(a, nullptr);
  }

 private:
  DeviceSet devices_;
  double particle_m3_;

 public:
  test::FilmedWorld world;
};

struct Puddle {
  double area_m2 = 0, volume_m3 = 0;
  int pieces = 0;
  double largest_m3 = 0;  ///< of the pieces
  Vec3d center_m{};       ///< of its volume
};

/// Of the wet vertices, with a third of each triangle round them.
Puddle puddle_of(const WetObstacle& wet) {
  Puddle all;
  const std::vector<float>& h = wet.film.film_m;
  std::vector<double> area_m2(h.size());
  std::vector<Index> root(h.size());
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](Index v) {
    while (root[static_cast<std::size_t>(v)] != v) v = root[static_cast<std::size_t>(v)];
    return v;
  };
  for (const auto& t : wet.mesh.triangles) {
    const auto x = [&](std::size_t k) { return wet.mesh.positions_m[static_cast<std::size_t>(t.at(k))]; };
    for (std::size_t k = 0; k < 3; ++k) {
      area_m2[static_cast<std::size_t>(t.at(k))] += double{length(cross(x(1) - x(0), x(2) - x(0)))} / 6;
      const Index a = t.at(k), b = t.at((k + 1) % 3);
      if (h[static_cast<std::size_t>(a)] > 0 && h[static_cast<std::size_t>(b)] > 0)
        root[static_cast<std::size_t>(find(a))] = find(b);
    }
  }
  std::map<Index, double> pieces_m3;
  for (std::size_t v = 0; v < h.size(); ++v) {
    if (!(h[v] > 0)) continue;
    all.area_m2 += area_m2[v];
    const double m3 = area_m2[v] * double{h[v]};
    all.volume_m3 += m3;
    pieces_m3[find(static_cast<Index>(v))] += m3;
    all.center_m += m3 * vec_cast<double>(wet.mesh.positions_m[v]);
  }
  all.pieces = static_cast<int>(pieces_m3.size());
  for (const auto& piece : pieces_m3) all.largest_m3 = std::max(all.largest_m3, piece.second);
  if (all.volume_m3 > 0) all.center_m = (1 / all.volume_m3) * all.center_m;
  return all;
}

Puddle puddle_on_first(test::FilmedWorld& world) {
  const FrameSnapshot now = world.snapshot();
  return now.wet_obstacles.empty() ? Puddle{} : puddle_of(now.wet_obstacles.front());
}

/// A slab of 20 x 20 x 2.5 mm, laid down. Young and Laplace's puddle at 40 degrees is 31.3 mm across
/// (film_test.cpp integrates it). 5 %, as for particles on a flat sheet (film_exchange_test.cpp). From a fall
/// of 2 mm, too, where fine particles may splash off and lie apart: up to four of 0.24 µl in eight such
/// falls, and 0.5 % is five times that.
TEST(FilmOnObstacle, AMillilitreIsOnePuddle) {
  for (const auto& [spacing_m, fall_m] : {std::pair{0.0025, 0.0},
                                          {0.00125, 0.0},
                                          {0.000625, 0.0},
                                          {0.0025, 0.002},
                                          {0.00125, 0.002},
                                          {0.000625, 0.002}}) {
    Scene scene = table();
    scene.fluid->spacing_m = spacing_m;
    scene.fluid->blocks[0].box.min_m.y += fall_m;
    scene.fluid->blocks[0].box.max_m.y += fall_m;
    WetTable wet(scene);
    StepReport report;
    for (int k = 0; k < 240; ++k) report = wet.step();
    const Puddle puddle = puddle_on_first(wet.world);
    const double across_m = std::sqrt(4 * puddle.area_m2 / M_PI);
    std::printf("d %.2f mm, fall %.0f mm: %d particles left, film %.4f ml, %.2f mm across, %d pieces\n",
                spacing_m * 1e3, fall_m * 1e3, report.liquid.here, puddle.volume_m3 * 1e6, across_m * 1e3,
                puddle.pieces);
    // The last ones lie in the middle, where the puddle is about as thick as a film may be: at most 2 %.
    const double particle_m3 = spacing_m * spacing_m * spacing_m;
    EXPECT_LE(report.liquid.here * particle_m3, 0.02e-6);
    EXPECT_NEAR(puddle.volume_m3 + report.liquid.here * particle_m3, 1e-6, 1e-9);
    EXPECT_NEAR(across_m, 31.3e-3, 0.05 * 31.3e-3);
    EXPECT_GE(puddle.largest_m3, (fall_m > 0 ? 0.995 : 1) * puddle.volume_m3);
  }
}

/// On the floor of 'fluid.box', too, where nothing else stands.
TEST(FilmOnObstacle, AMillilitreIsOnePuddleOnTheFloor) {
  Scene scene = table();
  scene.obstacles.clear();
  scene.fluid->box.min_m.y = 0;
  scene.fluid->open = LiquidOpen::sides;
  WetTable wet(scene);
  StepReport report;
  for (int k = 0; k < 240; ++k) report = wet.step();
  const FrameSnapshot now = wet.world.snapshot();
  ASSERT_EQ(now.wet_obstacles.size(), 1U);
  EXPECT_EQ(now.wet_obstacles[0].name, kLiquidFloorName);
  const Puddle puddle = puddle_of(now.wet_obstacles[0]);
  const double across_m = std::sqrt(4 * puddle.area_m2 / M_PI);
  std::printf("on the floor: %d particles left, %.2f mm across, %d pieces\n", report.liquid.here,
              across_m * 1e3, puddle.pieces);
  EXPECT_NEAR(across_m, 31.3e-3, 0.15 * 31.3e-3);
  EXPECT_EQ(puddle.pieces, 1);
}

/// One particle of 2 mm, a ball of 2.5 mm across, on a board: it holds up to 50 degrees (Furmidge 1962, as
/// film_test.cpp derives it). So it stays on 30, within a triangle's 2 mm, and on 70 it slides off.
TEST(FilmOnObstacle, ADropStaysOnASlopeOf30DegreesAndSlidesOn70) {
  for (const double slope_deg : {30.0, 70.0}) {
    Scene scene = table();
    scene.fluid->spacing_m = 0.002;
    scene.obstacles[0].placement.rotation_deg = {0, 0, -slope_deg};
    const double rad = slope_deg * M_PI / 180;
    const Vec3d along{std::cos(rad), -std::sin(rad), 0}, up{std::sin(rad), std::cos(rad), 0};
    scene.obstacles[0].placement.position_m = -0.01 * up;
    const Vec3d middle = -0.02 * along + 0.0012 * up, half{0.00101, 0.00101, 0.00101};
    scene.fluid->blocks[0].box = {middle - half, middle + half};
    WetTable wet(scene);
    StepReport report = wet.step();
    EXPECT_EQ(report.liquid.placed, 1U);
    for (int k = 1; k < 15; ++k) report = wet.step();
    const Puddle first = puddle_on_first(wet.world);
    ASSERT_EQ(report.film.taken, 1U) << slope_deg;
    for (int k = 0; k < 120; ++k) wet.step();
    const Puddle last = puddle_on_first(wet.world);
    const double way_m = dot(last.center_m - first.center_m, along);
    std::printf("on %.0f degrees: from %.2f mm by %.2f mm in 2 s\n", slope_deg,
                1e3 * dot(first.center_m - middle, along), 1e3 * way_m);
    if (slope_deg < 50)
      EXPECT_LT(way_m, 0.002);
    else
      EXPECT_GT(way_m, 0.01);
  }
}

/// Blood pours on a ball and a cube that stand on a plane: it runs over them, drips, and spreads on the
/// floor. The ledger is checked in each frame.
Scene ball_and_cube() {
  Scene scene = table();
  scene.obstacles.clear();
  for (const ObstacleShape kind : {ObstacleShape::plane, ObstacleShape::sphere, ObstacleShape::box}) {
    ObstacleSetting& o = scene.obstacles.emplace_back();
    o.kind = kind;
    o.radius_m = 0.01;
    o.size_m = {0.02, 0.02, 0.02};
  }
  scene.obstacles[0].name = "floor";
  scene.obstacles[1].name = "ball";
  scene.obstacles[2].name = "cube";
  scene.obstacles[1].placement.position_m = {-0.015, 0.01, 0};
  scene.obstacles[2].placement.position_m = {0.015, 0.01, 0};
  scene.fluid->box = {{-0.04, 0, -0.04}, {0.04, 0.05, 0.04}};
  scene.fluid->open = LiquidOpen::sides;
  scene.fluid->blocks[0].box = {{-0.02, 0.022, -0.005}, {0.02001, 0.02701, 0.00501}};
  return scene;
}

TEST(FilmOnObstacle, RunsOverABallAndACubeOntoTheFloor) {
  WetTable wet(ball_and_cube());
  std::set<std::string> seen;
  for (int k = 0; k < 60; ++k) {
    wet.step();
    if (k % 10 == 9)
      for (const WetObstacle& w : wet.world.snapshot().wet_obstacles) seen.insert(w.name);
  }
  EXPECT_EQ(seen, (std::set<std::string>{"ball", "cube", "floor"}));
  // Below the cube there is none.
  const FrameSnapshot last = wet.world.snapshot();
  int below = 0;
  for (const WetObstacle& w : last.wet_obstacles)
    for (const Vec3f& x : w.mesh.positions_m)
      if (w.name == "floor" && std::abs(x.x - 0.015F) < 0.007F && std::abs(x.z) < 0.007F) ++below;
  EXPECT_EQ(below, 0);
}

class FilmOnObstacles : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(FilmOnObstacles);

struct Seen {
  std::vector<Vec3f> liquid_m;
  std::vector<std::vector<float>> film_m;
  std::vector<std::vector<Vec3f>> surface_m;
  bool operator==(const Seen&) const = default;
};

Seen seen(test::FilmedWorld& world) {
  FrameSnapshot s = world.snapshot();
  Seen all{std::move(s.liquid_m), {}, {}};
  for (WetObstacle& w : s.wet_obstacles) {
    all.film_m.push_back(std::move(w.film.film_m));
    all.surface_m.push_back(std::move(w.mesh.positions_m));
  }
  return all;
}

/// The cube turns and goes aside.
Scene moved_cube() {
  Scene scene = ball_and_cube();
  scene.obstacles[2].motion = {{0, {}, 0}, {0.5, {0.01, 0.002, 0}, 30}};
  return scene;
}

TEST_P(FilmOnObstacles, HasTheSameBits) {
  const auto play = [](const std::string& devices) {
    WetTable wet(moved_cube(), devices);
    for (int k = 0; k < 15; ++k) wet.step();
    return seen(wet.world);
  };
  static const Seen on_cpu = play("cpu");
  EXPECT_GT(on_cpu.film_m.size(), 1U);
  EXPECT_TRUE(play(GetParam()) == on_cpu);
}

TEST_P(FilmOnObstacles, GoesOnFromACheckpoint) {
  WetTable whole(moved_cube(), GetParam()), first(moved_cube(), GetParam()), second(moved_cube(), GetParam());
  for (int k = 0; k < 14; ++k) whole.step();
  for (int k = 0; k < 7; ++k) first.step();
  second.restore(first.archived());
  for (int k = 0; k < 7; ++k) second.step();
  EXPECT_FALSE(seen(second.world).film_m.empty());
  EXPECT_TRUE(seen(second.world) == seen(whole.world));
}

/// A table with a puddle goes 3 cm up and aside in half a second and turns by 20 degrees about the vertical:
/// the puddle goes with it. At 0.06 m/s nothing flows in 0.5 s by more than a triangle's 2.5 mm.
TEST(FilmOnObstacle, MovesWithItsObstacle) {
  Scene scene = table();
  scene.obstacles[0].held = true;
  scene.fluid->box = {{-0.09, -0.05, -0.09}, {0.09, 0.09, 0.09}};
  WetTable wet(scene);
  for (int k = 0; k < 90; ++k) wet.step();
  const Puddle before = puddle_on_first(wet.world);
  ASSERT_GT(before.volume_m3, 0.9e-6);
  const Rigidd rest = wet.world.pose("table");
  for (int k = 1; k <= 30; ++k) {
    const double share = k / 30.0;
    wet.world.set_pose("table", {rotation_from_vector(Vec3d{0, share * 20 * M_PI / 180, 0}) * rest.R,
                                 rest.t + share * Vec3d{0.02, 0.02, 0.01}});
    wet.step();
  }
  const Puddle after = puddle_on_first(wet.world);
  const Rigidd now = wet.world.pose("table");
  const Vec3d moved =
      transpose(now.R) * (after.center_m - now.t) - transpose(rest.R) * (before.center_m - rest.t);
  EXPECT_LT(length(moved), 0.0025);
  EXPECT_NEAR(after.volume_m3, before.volume_m3, 0.02 * before.volume_m3);
}

/// 6 x 6 m with a vertex each 2.5 mm or less is some 10 million: it gets none, and says so. The table has its
/// film all the same.
TEST(FilmOnObstacle, SaysThatAnObstacleIsTooLarge) {
  Scene scene = table();
  ObstacleSetting& floor = scene.obstacles.emplace_back();
  floor.name = "floor";
  floor.placement.position_m = {0, -0.04, 0};
  scene.fluid->box = {{-3, -0.05, -3}, {3, 0.05, 3}};
  WetTable wet(scene);
  StepReport report = wet.step();
  const auto full = std::find_if(report.notices.begin(), report.notices.end(),
                                 [](const Notice& n) { return n.code == "liquid.film_full"; });
  ASSERT_NE(full, report.notices.end());
  EXPECT_NE(full->text.find("obstacle 'floor' has no film"), std::string::npos) << full->text;
  for (int k = 0; k < 30; ++k) report = wet.step();
  EXPECT_GT(report.film.taken, 10U);
}

}  // namespace
}  // namespace tactus
