/// A body that gets capacity for more cuts is the body that had it from the start.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tactus/world/world.h"

namespace tactus {
namespace {

constexpr double kFrame_s = 1.0 / 30;

FixedRegion half_space(Vec3d point_m, Vec3d normal) {
  FixedRegion region;
  region.where.kind = RegionKind::half_space;
  region.where.frame = CoordinateFrame::world;
  region.where.point_m = point_m;
  region.where.normal = normal;
  return region;
}

/// Two viscoelastic blocks in a stack; a blade cuts both, one after the other, and parts lie on each other.
Scene stack_scene() {
  Scene scene;
  BodyDescription low;
  low.name = "low";
  low.cuttable = true;
  low.shape.size_m = {0.3, 0.15, 0.3};
  low.placement.position_m = {0, -0.3, 0};
  low.spacing_m = 0.05;
  low.material.model = TissueModel::tled;
  low.material.relaxation = {{0.4, 0.1}};
  BodyDescription high = low;
  high.name = "high";
  high.placement.position_m = {0.02, -0.149, 0};
  scene.bodies = {low, high};
  scene.bodies[0].fixed.push_back(half_space({0, -0.36, 0}, {0, 1, 0}));
  BladeDescription blade;
  blade.name = "slicer";
  blade.from_m = {-0.2, -0.16, -0.3};
  blade.to_m = {-0.2, -0.14, 0.3};
  blade.path = {{0.05, {}, 0}, {0.5, {0.5, -0.3, 0}, 0}};
  scene.blades = {blade};
  return scene;
}

/// Two strokes cut a plug out of a slab, which bleeds into a box, and is wet; a vessel flows onto it.
Scene bleeding_scene() {
  Scene scene = stack_scene();
  scene.contact.cut_walls = false;
  BodyDescription& slab = scene.bodies[0];
  slab.shape.size_m = {0.4, 0.1, 0.2};
  slab.placement.position_m = {0, -0.2, 0};
  slab.material.young_modulus_pa = 200000;
  slab.bleeding = BleedingDescription{0.05, 0.5, {}};
  slab.fixed = {half_space({-0.16, 0, 0}, {1, 0, 0}), half_space({0.16, 0, 0}, {-1, 0, 0})};
  scene.bodies.resize(1);
  BladeDescription& left = scene.blades[0];
  left.from_m = {-0.072, 0, -0.3};
  left.to_m = {-0.072, 0, 0.3};
  left.path = {{0.05, {}, 0}, {0.35, {0, -0.3, 0}, 0}};
  BladeDescription right = left;
  right.name = "second";
  right.from_m.x = right.to_m.x = 0.074;
  scene.blades.push_back(right);
  LiquidDescription& blood = scene.fluid.emplace();
  blood.spacing_m = 0.02;
  blood.box = {{-0.3, -0.6, -0.2}, {0.3, 0.2, 0.2}};
  blood.max_particles = 3000;
  blood.surface_tension_n_m = 0.05;
  blood.contact_angle_deg = 40;
  blood.max_speed_m_s = 3;
  blood.emitters.push_back({"vessel", {0.12, 0.1, 0}, {0, -1, 0}, 0.03, 0.5, 0.1, {}});
  return scene;
}

Index capacity_of(const test::FilmedWorld& world, std::size_t body = 0) {
  return static_cast<Index>(world.bodies()[body]->shape().lattice.copies.size());
}

struct Played {
  std::string hash;  ///< nodes with all capacity, liquid, films
  std::vector<BodyMonitors> monitors;
  std::vector<std::array<double, 3>> cuts;
  std::vector<Vec3d> contact_N;
  Index capacity = 0, copies = 0;
  int full = 0;
  std::string state;
  double film_m3 = 0;
};

/// @param grows_at the first body grows before this frame @param state to go on from at frame `from`
Played play(const std::string& devices_text, const Scene& scene, int from, int to, int grows_at = -1,
            const std::string& state = {}) {
  DeviceSet devices(devices_text, 3);
  test::FilmedWorld world(devices, scene, {}, {});
  if (!state.empty()) world.load_state(state, nullptr);
  Played played;
  for (int k = from; k < to; ++k) {
    if (k == grows_at) {
      EXPECT_TRUE(world.impl().grow(0, false));
    }
    const StepReport report = world.step(nullptr, k == 0 ? 0 : kFrame_s);
    for (const BodyContact& contact : report.contacts)
      played.contact_N.push_back(vec_cast<double>(contact.reaction.force_N));
    played.film_m3 = report.film.film_m3;
    for (const Notice& n : report.notices) played.full += n.code == "cut.full" ? 1 : 0;
  }
  played.hash = state_hash(world);
  played.monitors = world.monitors();
  for (const CutScore& cut : world.cuts()) played.cuts.push_back({cut.area_m2, cut.due_m3, cut.bled_m3});
  played.capacity = capacity_of(world);
  played.copies = world.bodies()[0]->cuts()->state(world.context()).copies;
  played.state = world.save_state(nullptr);
  return played;
}

void expect_same(const Played& a, const Played& b) {
  EXPECT_EQ(a.capacity, b.capacity);
  EXPECT_EQ(a.copies, b.copies);
  EXPECT_EQ(a.hash, b.hash);
  EXPECT_EQ(a.monitors, b.monitors);
  EXPECT_EQ(a.cuts, b.cuts);
  EXPECT_EQ(a.contact_N, b.contact_N);
}

class CutGrowthOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(CutGrowthOnDevices);

/// In the middle of a stroke, while parts of both bodies touch: the same bits as with that capacity from the
/// start, and as without growth.
TEST_P(CutGrowthOnDevices, IsTheBodyThatHadTheCapacity) {
  Scene scene = stack_scene(), large = scene;
  large.bodies[0].cut_capacity = 4000;
  const Played whole = play(GetParam(), large, 0, 18), grown = play(GetParam(), scene, 0, 18, 9);
  ASSERT_GT(whole.copies, 20);
  EXPECT_EQ(whole.capacity, 4000);
  EXPECT_FALSE(whole.contact_N.empty());
  expect_same(whole, grown);
}

/// Where shape matching moves some of the points, and a body on several devices is in slabs.
TEST_P(CutGrowthOnDevices, IsThatAlsoOfTwoKindsOfTissueInSlabs) {
  Scene scene = stack_scene();
  scene.bodies.resize(1);
  scene.contact.cut_walls = false;
  BodyDescription& body = scene.bodies[0];
  body.material.model = TissueModel::hybrid;
  body.material.half_width = 2;
  body.material.relaxation.clear();
  body.ratio = RatioDescription{1, 1, Axis::x};
  body.shape.size_m = {0.4, 0.15, 0.4};
  ObstacleSetting table;
  table.name = "table";
  table.placement.position_m = {0, -0.4, 0};
  scene.obstacles.push_back(table);
  BladeDescription& blade = scene.blades[0];
  for (Vec3d* end : {&blade.from_m, &blade.to_m}) end->x = -0.13;
  blade.path = {{0.05, {}, 0}, {0.4, {0, -0.25, 0}, 0}};
  Scene large = scene;
  large.bodies[0].cut_capacity = 4000;
  const Played whole = play(GetParam(), large, 0, 14), grown = play(GetParam(), scene, 0, 14, 8);
  ASSERT_GT(whole.copies, 20);
  expect_same(whole, grown);
}

/// Wounds that bleed, walls of the liquid, and films go on.
TEST_P(CutGrowthOnDevices, BleedsAsBefore) {
  Scene scene = bleeding_scene(), large = scene;
  large.bodies[0].cut_capacity = 4000;
  const Played whole = play(GetParam(), large, 0, 14), grown = play(GetParam(), scene, 0, 14, 9);
  ASSERT_GT(whole.copies, 20);
  ASSERT_EQ(whole.cuts.size(), 2U);
  EXPECT_GT(whole.cuts[0][2], 0) << "it bleeds";
  EXPECT_GT(whole.film_m3, 0) << "it is wet";
  EXPECT_EQ(whole.film_m3, grown.film_m3);
  expect_same(whole, grown);
}

/// Blades at random through all of a body that floats, each in a frame of its own.
Scene strokes_scene(ShapeDescription shape, double spacing_m, double radius_m, int strokes, unsigned seed,
                    int frames_of_stroke) {
  Scene scene;
  scene.gravity_m_s2 = {};
  BodyDescription body;
  body.name = "body";
  body.cuttable = true;
  body.contact = false;
  body.shape = std::move(shape);
  body.spacing_m = spacing_m;
  body.material.model = TissueModel::tled;
  scene.bodies = {body};
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto direction = [&] {
    return normalized(Vec3d{uniform(random), uniform(random), uniform(random)}, Vec3d{1, 0, 0});
  };
  for (int k = 0; k < strokes; ++k) {
    const Vec3d along = direction(), across = normalized(cross(along, direction()), Vec3d{0, 0, 1});
    const Vec3d middle = 0.6 * radius_m * uniform(random) * cross(along, across);
    const double reach_m = 1.3 * radius_m, begin_s = (2 + (frames_of_stroke + 1) * k) * kFrame_s;
    BladeDescription& blade = scene.blades.emplace_back();
    blade.name = "blade " + std::to_string(k);
    blade.from_m = middle - reach_m * (along + across);
    blade.to_m = middle - reach_m * (along - across);
    blade.path = {{begin_s, {}, 0}, {begin_s + frames_of_stroke * kFrame_s, 2 * reach_m * along, 0}};
  }
  return scene;
}

/// A body of 512 cubes is full of cuts at the automatic capacity, and grows while blades cut it: with the
/// same bits as with the larger capacity from the start. A checkpoint of it goes on. Other devices: the bits
/// of the CPU.
TEST_P(CutGrowthOnDevices, HappensWhenStrokesNeedIt) {
  ShapeDescription box;
  box.size_m = {0.08, 0.08, 0.08};
  constexpr int kStrokes = 16, kFrames = 2 * kStrokes + 4;
  const Scene scene = strokes_scene(box, 0.01, 0.04 * std::sqrt(3.0), kStrokes, 5, 1);
  Scene large = scene;
  large.bodies[0].cut_capacity = 4000;
  static const Played grown = play("cpu", scene, 0, kFrames);
  if (GetParam() == "cpu") {
    EXPECT_EQ(grown.capacity, 4000);
    EXPECT_EQ(grown.full, 0);
    const Played whole = play("cpu", large, 0, kFrames);
    expect_same(whole, grown);
  }
  const Played first = play(GetParam(), scene, 0, kFrames - 3),
               second = play(GetParam(), scene, kFrames - 3, kFrames, -1, first.state);
  EXPECT_EQ(first.capacity, 4000);
  EXPECT_EQ(first.full, 0);
  EXPECT_EQ(second.hash, grown.hash);
}

/// Likewise in contact with itself and an obstacle, while it bleeds: walls and wounds of the frame's earlier
/// strips come with those of the strip that finds it full.
TEST(CutGrowth, HappensWhileItBleedsAndTouches) {
  if (std::getenv("TACTUS_LONG_TESTS") == nullptr) GTEST_SKIP() << "a minute: TACTUS_LONG_TESTS is not set";
  ShapeDescription box;
  box.size_m = {0.08, 0.08, 0.08};
  constexpr int kStrokes = 10, kFrames = 2 * kStrokes + 6;
  Scene scene = strokes_scene(box, 0.01, 0.04 * std::sqrt(3.0), kStrokes, 5, 1);
  scene.gravity_m_s2 = {0, -2, 0};
  scene.bodies[0].contact = true;
  scene.bodies[0].bleeding = BleedingDescription{0.05, 0.5, {}};
  // Two blades at once: the first one's cuts come before growth.
  for (std::size_t b = 1; b < scene.blades.size(); b += 2)
    for (std::size_t k = 0; k < 2; ++k) scene.blades[b].path[k].time_s = scene.blades[b - 1].path[k].time_s;
  ObstacleSetting table;
  table.name = "table";
  table.placement.position_m = {0, -0.05, 0};
  scene.obstacles.push_back(table);
  LiquidDescription& blood = scene.fluid.emplace();
  blood.spacing_m = 0.01;
  blood.box = {{-0.1, -0.1, -0.1}, {0.1, 0.1, 0.1}};
  blood.max_particles = 2000;
  blood.max_speed_m_s = 2;
  blood.surface_tension_n_m = 0.05;
  blood.contact_angle_deg = 40;
  Scene large = scene;
  large.bodies[0].cut_capacity = 4000;
  const Played whole = play("cpu", large, 0, kFrames), grown = play("cpu", scene, 0, kFrames);
  EXPECT_EQ(grown.full, 0);
  double bled_m3 = 0;
  for (const auto& cut : grown.cuts) bled_m3 += cut[2];
  EXPECT_GT(bled_m3, 0);
  expect_same(whole, grown);
}

/// A ball, seen by cameras, comes down onto the stack while it is cut: its surface stays when stages are
/// added anew.
TEST_P(CutGrowthOnDevices, KeepsTheSurfaceThatCamerasSee) {
  Scene scene = stack_scene();
  scene.reconstruction.resolution = 32;
  constexpr double kUp_m = 0.4;
  for (BodyDescription& body : scene.bodies) body.placement.position_m.y += kUp_m;
  scene.bodies[0].fixed[0].where.point_m.y += kUp_m;
  for (Vec3d* end : {&scene.blades[0].from_m, &scene.blades[0].to_m}) end->y += kUp_m;
  Scene large = scene;
  large.bodies[0].cut_capacity = 4000;
  const auto hash_of = [&](const Scene& of, int grows_at, double& contact_N) {
    DeviceSet devices(GetParam(), 3);
    test::FilmedWorld world(devices, of, make_synthetic_rig(), {});
    for (int k = 0; k < 14; ++k) {
      SyntheticOptions options;
      options.figure = "sphere";
      options.shape.scale = 0.6F;
      options.shape.offset_m = {0, 0.02F - 0.015F * static_cast<float>(k), 0};
      options.depth = options.truth = false;
      SyntheticSource source(options);
      FrameSet frame;
      EXPECT_EQ(source.next(frame), NextFrame::success);
      frame.tick = k;
      frame.time_s = k * kFrame_s;
      if (k == grows_at) {
        EXPECT_TRUE(world.impl().grow(0, false));
      }
      // The frame after growth has no new images: the ball goes on as it did.
      const StepReport report = world.step(k == 10 ? nullptr : &frame, k == 0 ? 0 : kFrame_s);
      contact_N += double{length(report.contact.force_N)};
    }
    EXPECT_GT(world.bodies()[0]->cuts()->state(world.context()).copies, 20);
    return state_hash(world);
  };
  double contact_N = 0, of_grown_N = 0;
  EXPECT_EQ(hash_of(large, -1, contact_N), hash_of(scene, 10, of_grown_N));
  EXPECT_GT(contact_N, 0) << "the ball presses";
  EXPECT_EQ(contact_N, of_grown_N);
}

/// A state from before the body grew is loaded into the world where it has, and the other way round.
TEST(CutGrowth, StatesFromBeforeAndAfterItAreLoaded) {
  const Scene scene = stack_scene();
  const Played before = play("cpu", scene, 0, 8), after = play("cpu", scene, 0, 12, 8);
  ASSERT_EQ(before.capacity, 2000);
  ASSERT_EQ(after.capacity, 4000);
  DeviceSet devices("cpu");
  test::FilmedWorld world(devices, scene, {}, {});
  for (const Played* state : {&after, &before, &after}) {
    world.load_state(state->state, nullptr);
    EXPECT_EQ(capacity_of(world), state->capacity);
    EXPECT_EQ(state_hash(world), state->hash);
  }
}

/// Random straight strokes through all of a box, a ball and a liver of some 8 spacings: no stroke finds the
/// body full.
TEST(CutGrowth, ManyRandomStrokesFindCapacity) {
  const int strokes = std::getenv("TACTUS_LONG_TESTS") != nullptr ? 200 : 50;
  ShapeDescription box, ball, liver;
  box.size_m = {0.08, 0.06, 0.07};
  ball.kind = ShapeKind::sphere;
  ball.radius_m = 0.037;
  liver.kind = ShapeKind::figure;
  liver.figure = "liver";
  unsigned seed = 0;
  for (const ShapeDescription& shape : {box, ball, liver}) {
    const bool is_liver = shape.kind == ShapeKind::figure;
    const int frames_of_stroke = is_liver ? 2 : 1;
    constexpr double kScale = 14 * 0.01 / 0.25;
    const Box3f bounds_m = make_figure("liver", {}).bounds_m();
    const double radius_m = is_liver ? 0.5 * kScale * double{length(bounds_m.extent())} : 0.06;
    Scene scene = strokes_scene(shape, 0.01, radius_m, strokes, ++seed, frames_of_stroke);
    if (is_liver) scene.bodies[0].placement = {-kScale * vec_cast<double>(bounds_m.center()), {}, kScale};
    const Played played = play("cpu", scene, 0, (frames_of_stroke + 1) * strokes + 4);
    std::printf("  %d copies, capacity for %d\n", int(played.copies), int(played.capacity));
    EXPECT_EQ(played.full, 0) << seed;
    EXPECT_GT(played.copies, strokes) << seed;
  }
}

/// A limit of the scene stays, and each stroke that needs more is told once, with the key.
TEST(CutGrowth, ALimitStaysAndEachStrokeIsToldOnce) {
  ShapeDescription box;
  box.size_m = {0.08, 0.08, 0.08};
  Scene scene = strokes_scene(box, 0.01, 0.04 * std::sqrt(3.0), 3, 5, 12);
  scene.bodies[0].cut_capacity = 100;
  DeviceSet devices("cpu");
  test::FilmedWorld world(devices, scene, {}, {});
  std::vector<Notice> full;
  for (int k = 0; k < 46; ++k)
    for (const Notice& n : world.step(nullptr, k == 0 ? 0 : kFrame_s).notices)
      if (n.code == "cut.full") full.push_back(n);
  EXPECT_EQ(capacity_of(world), 100);
  ASSERT_EQ(full.size(), 3U);
  for (const Notice& n : full) EXPECT_NE(n.remedy.find("'cut_capacity'"), std::string::npos);
}

/// Blades that begin in one frame are strokes of their own: each that finds the body full is told, once.
TEST(CutGrowth, StrokesOfOneFrameAreToldEach) {
  ShapeDescription box;
  box.size_m = {0.08, 0.08, 0.08};
  constexpr int kStrokes = 6;
  Scene scene = strokes_scene(box, 0.01, 0.04 * std::sqrt(3.0), kStrokes, 5, 6);
  scene.bodies[0].cut_capacity = 8;  // fewer than any of them needs
  for (BladeDescription& blade : scene.blades) {
    blade.path[0].time_s = 2 * kFrame_s;
    blade.path[1].time_s = 8 * kFrame_s;
  }
  DeviceSet devices("cpu");
  test::FilmedWorld world(devices, scene, {}, {});
  std::map<std::string, int> told;
  for (int k = 0; k < 12; ++k)
    for (const Notice& n : world.step(nullptr, k == 0 ? 0 : kFrame_s).notices)
      if (n.code == "cut.full") ++told[n.text.substr(0, n.text.find(" in body"))];
  ASSERT_EQ(told.size(), std::size_t{kStrokes});
  for (const auto& [blade, count] : told) EXPECT_EQ(count, 1) << blade;
}

}  // namespace
}  // namespace tactus
