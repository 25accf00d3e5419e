/// Bodies on many devices that are touched. What one device makes of them is the reference: the same bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "contact/contact_scene.h"
#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/multi_device/device_replay.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/tissue/cut/cut_points.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {
namespace {

constexpr ElasticMaterial kMaterial{.young_Pa = 20000, .poisson = 0.45F};
constexpr float kH = 0.005F;
constexpr Vec3i kCubes{5, 4, 48};

struct Case {
  const char* name;
  double elements = 1, matched = 0;  ///< shares of the nodes, along y: cuts go through both
  int matching_every = 1;
  bool moved = false;      ///< nodes over its whole length, let go in the third frame
  bool inside = false;     ///< the first surface is one that came from nowhere, deep in the body
  int stop_at_frame = -1;  ///< the body has blown up then
  int cut_at_frame = -1;   ///< a slit along the bar, which goes on in the next frame
  int frames = 4, substeps = 6;
};
constexpr Case kCases[] = {{.name = "elements"},
                           {.name = "shape matching", .elements = 0, .matched = 1},
                           {.name = "both", .matched = 1},
                           {.name = "both, matched every other", .matched = 1, .matching_every = 2},
                           {.name = "elements, moved", .moved = true},
                           {.name = "both, moved", .matched = 1, .moved = true},
                           {.name = "pushed out", .matched = 1, .inside = true, .frames = 2},
                           {.name = "stopped", .stop_at_frame = 2},
                           {.name = "cut", .cut_at_frame = 1, .frames = 6}};

/// A bar along the axis that is cut, of which one corner's edge is fixed.
struct Bar {
  explicit Bar(const Case& c) : lattice(lattice_from_box({}, kCubes, {.spacing_m = kH})) {
    const Vec3f half = 0.5F * kH * vec_cast<float>(kCubes);
    surface = test::transformed(test::box(half, 1), {Mat3f::identity(), half});
    lattice.fix_where([](Vec3f p) { return p.x < 1e-6F && p.y < 1e-6F; });
    elements = split_by_ratio(lattice, 1, c.elements, c.matched);
    if (c.cut_at_frame >= 0) {
      lattice = cut_lattice(lattice, [](Vec3i, int) { return false; }, {.copies = 600, .nodes = 900});
      elements.resize(lattice.cubes.size(), 1);
    }
    if (!c.moved) return;
    NodeMotion& side = motions.emplace_back();
    side.name = "side";
    side.keys = {{0.01, {0, 0.001, 0}, 0}};
    side.release_s = 1.6 * c.substeps * static_cast<double>(step_s());
    for (Index i = 0; i < lattice.node_count(); ++i) {
      const Vec3i n = lattice.nodes[static_cast<std::size_t>(i)];
      if (n.x == kCubes.x && n.y == 2) side.nodes.push_back(i);
    }
  }
  static float step_s() { return 1e-4F; }
  CubeLattice lattice;
  TriangleMesh surface;
  ElementMask elements;
  std::vector<NodeMotion> motions;
};

/// A finger that slides along the bar, over the first cut, and one that presses on the second.
TriangleMesh fingers(const Case& c, int frame) {
  const float deep = c.inside && frame == 0 ? 0.012F : 0.0006F;
  const Vec3f first{0.5F * kH * kCubes.x, kH * kCubes.y + 0.02F - deep,
                    0.07F + 0.0012F * static_cast<float>(frame)},
      second{kH * kCubes.x + 0.0194F - 0.0004F * static_cast<float>(frame), 0.5F * kH * kCubes.y, 0.1625F};
  return test::together(test::transformed(test::unit_sphere(10), {Mat3f::identity(), first}, 0.02F),
                        test::transformed(test::unit_sphere(10), {Mat3f::identity(), second}, 0.02F));
}

/// What the bar stands on, and what is in the way of its end.
std::vector<ObstacleDescription> obstacles() {
  ObstacleDescription floor, block;
  floor.name = "floor";
  floor.T_world_obstacle = {Mat3f::identity(), {0, 0.0001F, 0}};
  block.name = "block";
  block.kind = ObstacleKind::box;
  block.half_m = {0.02F, 0.02F, 0.0305F};
  block.T_world_obstacle = {Mat3f::identity(), {-0.0199F, 0.02F, 0.09F}};
  return {floor, block};
}

struct Played {
  std::vector<Vec3f> x_m, v_m_s;
  std::vector<std::vector<ColliderTotals>> totals;  ///< per frame
  std::vector<std::vector<Index>> touched;          ///< per frame, ascending
  int slabs = 0;
};

class Player {
 public:
  Player(DeviceSet& devices, const Case& c)
      : devices_(devices),
        case_(c),
        bar_(c),
        tissue_(devices,
                {.lattice = bar_.lattice,
                 .elements = bar_.elements,
                 .materials = {&kMaterial, 1},
                 .tled = {.damping_ratio = 0.2F},
                 .flsm = {.young_Pa = 20000, .half_width = 1},
                 .conditions = {bar_.motions, {}, nullptr}},
                {.least_elements = 0, .changes = c.matching_every > 1 ? 2 : 1}),
        boundary_(body_boundary(bar_.lattice, bar_.surface, bar_.elements)),
        points_(tissue_, bar_.lattice, boundary_, c.cut_at_frame >= 0 ? kPointCapacity : 0),
        world_(devices, tissue_.slab_count(), test::small_surface(kH),
               {.restitution = 0.3F, .friction = 0.4F}, obstacles()),
        frame_(devices),
        readback_(devices) {
    tissue_.follow(frame_);
    tissue_.add_reports(readback_);
    points_.add_reports(readback_);
    if (c.cut_at_frame < 0) return;
    cutter_.emplace(bar_.lattice, std::vector<std::uint8_t>{}, bar_.surface,
                    anchor_vertices(bar_.lattice, bar_.surface),
                    cut::CutSurface::Capacity{.vertices = 60000, .triangles = 60000});
    cut_points_ = cut::CutPoints(bar_.lattice, boundary_.points, boundary_.anchors, boundary_.bearing,
                                 boundary_.first_count, kPointCapacity);
  }
  ~Player() { devices_.synchronize(); }
  Played play() {
    Played played;
    played.slabs = tissue_.slab_count();
    const float dt_s = Bar::step_s(), frame_s = dt_s * static_cast<float>(case_.substeps);
    for (int f = 0; f < case_.frames; ++f) {
      if (f == case_.stop_at_frame) tissue_.stop();
      if (cutter_ && (f == case_.cut_at_frame || f == case_.cut_at_frame + 1)) cut(f - case_.cut_at_frame);
      const test::DeviceMesh mesh(devices_.context(0), fingers(case_, f));
      frame_.begin({.dt_s = dt_s,
                    .dt_before_s = f > 0 ? dt_s : 0,
                    .dt_capture_s = f > 0 ? frame_s : 0,
                    .surface_age_s = -frame_s,
                    .gravity_m_s2 = {0, -9.81F, 0},
                    .substeps = case_.substeps});
      world_.update({mesh.vertices.const_view(),
                     mesh.triangles.const_view(),
                     mesh.vertices.size(),
                     mesh.triangles.size(),
                     {}},
                    frame_);
      replay_.run(devices_, [&] { submit(); });
      devices_.synchronize();
      played.totals.push_back(points_.totals(readback_));
      std::vector<Index> touched = points_.touched();
      std::sort(touched.begin(), touched.end());
      touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
      played.touched.push_back(touched);
    }
    played.x_m = tissue_.positions_m();
    played.v_m_s = tissue_.velocities_m_s();
    EXPECT_TRUE(played.x_m == to_host(devices_.context(0), tissue_.body().x_m.const_view()));
    return played;
  }

 private:
  static constexpr Index kPointCapacity = 3000;
  /// From above, over both cuts between three slabs: to the middle of the bar's height, then on.
  void cut(int part) {
    const auto edge = [](float y) {
      return std::vector<Vec3f>{{2.4F * kH, y * kH, 9.3F * kH}, {2.4F * kH, y * kH, 38.7F * kH}};
    };
    TopologyChange change;
    const auto top = static_cast<float>(kCubes.y + 1);
    cutter_->cut({edge(part == 0 ? top : 2.45F), edge(part == 0 ? 2.45F : 1.4F), part}, tissue_.positions_m(),
                 change);
    EXPECT_GT(change.copies.size(), 20U);
    tissue_.apply(change);
    tactus::apply(change, bar_.lattice);
    points_.apply(change, bar_.lattice, cut_points_.update(cutter_->lattice(), cutter_->surface(), change));
  }
  void submit() {
    world_.begin_frame(frame_);
    tissue_.begin_frame();
    tissue_.begin_substeps();
    points_.begin_frame(world_);
    const BodyStep step{.matching_every = case_.matching_every};
    for (int k = 0; k < case_.substeps; ++k) {
      tissue_.substep(step, k, case_.substeps);
      points_.correct(world_, k, case_.matching_every);
      tissue_.check_nodes(k, case_.substeps);
    }
    frame_.end_block(case_.substeps);
    points_.end_frame();
    tissue_.end_substeps(0);
    tissue_.end_frame(0);
    readback_.submit();
  }

  DeviceSet& devices_;
  const Case& case_;
  Bar bar_;
  BodySolver tissue_;
  BodyBoundary boundary_;
  SlabPoints points_;
  std::optional<cut::BodyCutter> cutter_;
  cut::CutPoints cut_points_;
  ContactOnDevices world_;
  FrameOnDevices frame_;
  Readback readback_;
  DeviceReplay replay_;
};

Played play(DeviceSet& devices, const Case& c) { return Player(devices, c).play(); }

Played on_one_cpu(const Case& c) {
  DeviceSet one("cpu");
  return play(one, c);
}

void expect_same_totals(const std::vector<ColliderTotals>& got, const std::vector<ColliderTotals>& expected) {
  ASSERT_EQ(got.size(), expected.size());
  for (std::size_t k = 0; k < got.size(); ++k) {
    const ColliderTotals &a = got[k], &b = expected[k];
    EXPECT_TRUE(std::memcmp(&a.sums, &b.sums, sizeof a.sums) == 0) << "collider " << k;
    EXPECT_EQ(a.contacts, b.contacts) << "collider " << k;
    EXPECT_EQ(a.pushed_out, b.pushed_out) << "collider " << k;
    EXPECT_EQ(a.max_depth_m, b.max_depth_m) << "collider " << k;
  }
}

void expect_same(const Played& got, const Played& expected, const std::string& what) {
  SCOPED_TRACE(what);
  EXPECT_TRUE(got.x_m == expected.x_m);
  EXPECT_TRUE(got.v_m_s == expected.v_m_s);
  EXPECT_EQ(got.touched, expected.touched);
  ASSERT_EQ(got.totals.size(), expected.totals.size());
  for (std::size_t f = 0; f < got.totals.size(); ++f) expect_same_totals(got.totals[f], expected.totals[f]);
}

class SlabContact : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(SlabContact);

TEST_P(SlabContact, TouchedBodiesAreThoseOfOneCpu) {
  for (const Case& c : kCases) {
    DeviceSet devices(GetParam(), 7);
    const Played got = play(devices, c);
    EXPECT_EQ(got.slabs > 1, devices.count() > 1);
    expect_same(got, on_one_cpu(c), c.name);
  }
}

/// Every case does what it is there for: both fingers, floor and block are touched, on both sides of a cut.
TEST(SlabContactCases, TouchWhatTheyShould) {
  for (const Case& c : kCases) {
    SCOPED_TRACE(c.name);
    const Played one = on_one_cpu(c);
    const CubeLattice lattice = Bar(c).lattice;
    for (const Vec3f& x : one.x_m) ASSERT_TRUE(std::isfinite(x.x + x.y + x.z));
    Index contacts[4] = {}, pushed_out = 0;
    for (const std::vector<ColliderTotals>& frame : one.totals) {
      for (const Index k : {0, 1, 2, 3}) contacts[k] += frame[k < 2 ? k : kComponents + k - 2].contacts;
      pushed_out += frame[0].pushed_out + frame[1].pushed_out;
    }
    for (const Index count : contacts) EXPECT_GT(count, 0);
    EXPECT_EQ(pushed_out > 0, c.inside);
    Index below = 0, above = 0;  // a cut of three equal slabs
    for (const Index node : one.touched.front()) {
      const Index z = lattice.nodes[static_cast<std::size_t>(node)].z;
      below += z >= 13 && z < 16 ? 1 : 0;
      above += z >= 16 && z < 19 ? 1 : 0;
    }
    EXPECT_GT(below, 0);
    EXPECT_GT(above, 0);
    // What was let go is touched next to a cut.
    const auto touched_then = [&](Index z) {
      return std::any_of(one.touched[2].begin(), one.touched[2].end(), [&](Index node) {
        const Vec3i n = lattice.nodes[static_cast<std::size_t>(node)];
        return n.x == kCubes.x && n.y == 2 && n.z == z;
      });
    };
    if (c.moved) {
      EXPECT_TRUE(touched_then(32) || touched_then(33));
    }
    if (c.stop_at_frame < 0) continue;
    const auto last = one.totals.back();
    for (const ColliderTotals& t : last) EXPECT_EQ(t.contacts, 0) << "contact moves a body that was stopped";
  }
}

/// Any legal order of the devices' queues, and nodes that are copied first where kernels can't read them.
TEST(SlabContactOrders, GiveTheSameBits) {
  const Case &elements = kCases[0], &both = kCases[3];
  const Played of_elements = on_one_cpu(elements), of_both = on_one_cpu(both);
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    DeviceSet devices("cpu:3", seed, seed % 2 == 0 ? PeerAccess::staged : PeerAccess::automatic);
    const bool odd = seed % 4 < 2;
    expect_same(play(devices, odd ? elements : both), odd ? of_elements : of_both,
                "seed " + std::to_string(seed));
  }
}

/// A ball presses a long bar of both models that is held at its low end; a cube beside it is too small to
/// cut.
Scene ball_scene() {
  Scene scene;
  scene.reconstruction.resolution = 32;
  BodyDescription bar;
  bar.material.half_width = 2;
  bar.name = "bar";
  bar.shape.size_m = {0.3, 0.05, 0.8};
  bar.placement.position_m = {0, 0.3, 0};
  bar.spacing_m = 0.025;
  bar.material.model = TissueModel::hybrid;
  bar.ratio = RatioDescription{};
  bar.material.young_modulus_pa = 20000;
  bar.material.density_kg_m3 = 300;
  bar.matching_every = 2;
  SpaceRegion bottom;
  bottom.kind = RegionKind::half_space;
  bottom.point_m = {0, -0.02, 0};
  bottom.normal = {0, 1, 0};
  bar.fixed.push_back({bottom});
  BodyDescription cube = bar;
  cube.name = "cube";
  cube.shape.size_m = {0.1, 0.1, 0.1};
  cube.placement.position_m = {0.4, 0.1, 0};
  cube.spacing_m = 0.05;
  cube.material.model = TissueModel::tled;
  cube.ratio.reset();
  cube.fixed.clear();
  cube.matching_every = 1;
  scene.bodies = {bar, cube};
  ObstacleSetting floor;
  floor.name = "floor";
  scene.obstacles.push_back(floor);
  scene.contact.bodies = false;
  return scene;
}

struct PlayedScene {
  std::vector<Vec3f> x_m;
  std::vector<Vec3f> reactions;  ///< per frame and contact: force, torque
  std::string components;
  int recordings = 0;
  int slabs = 0;
};

PlayedScene play_scene(const std::string& devices_text, std::uint64_t seed) {
  DeviceSet devices(devices_text, seed);
  SyntheticOptions options;
  options.figure = "sphere";
  options.depth = options.truth = false;
  test::FilmedWorld simulation(devices, ball_scene(), make_synthetic_rig(), {});
  PlayedScene played;
  FrameSet frame;
  for (int k = 0; k < 10; ++k) {
    // Its lowest point comes from 5 mm above the bar's top to 2 cm below.
    options.shape = {.scale = 0.6F, .offset_m = {0, 0.33F - 0.35F - 0.0025F * static_cast<float>(k), 0.05F}};
    EXPECT_EQ(SyntheticSource(options).next(frame), NextFrame::success);
    frame.time_s = k / 30.0;
    const StepReport report = simulation.step(frame, k == 0 ? 0 : 1.0 / 30);
    for (const BodyContact& c : report.contacts) {
      played.components += c.body + " " + c.component + "; ";
      played.reactions.insert(played.reactions.end(), {c.reaction.force_N, c.reaction.torque_N_m});
    }
  }
  for (const auto& body : simulation.bodies()) {
    const std::vector<Vec3f> x = body->positions_m(devices.context(0));
    played.x_m.insert(played.x_m.end(), x.begin(), x.end());
  }
  played.recordings = simulation.schedule().recordings();
  played.slabs = simulation.bodies()[0]->tissue().slab_count();
  EXPECT_EQ(simulation.bodies()[1]->tissue().slab_count(), 1);
  return played;
}

TEST_P(SlabContact, ABallPressesABarOnManyDevicesAsOnOne) {
  static const PlayedScene expected = play_scene("cpu", 0);
  EXPECT_NE(expected.components.find("bar 0; "), std::string::npos) << expected.components;
  EXPECT_NE(expected.components.find("cube floor; "), std::string::npos) << expected.components;
  const PlayedScene got = play_scene(GetParam(), 3);
  EXPECT_TRUE(got.x_m == expected.x_m);
  EXPECT_EQ(got.reactions, expected.reactions);
  EXPECT_EQ(got.components, expected.components);
  EXPECT_EQ(got.recordings, 1);
  EXPECT_EQ(got.slabs, GetParam() == "cpu:2" || GetParam() == "cpu:3" ? 2 : 1);
}

}  // namespace
}  // namespace tactus
