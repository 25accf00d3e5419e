/// A real scalpel that the cameras see cuts a body.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "support/filmed_world.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/geom/image/rasterize.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic/synthetic_noise.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

/// The figure sweeps its edge through a bar along its way.
constexpr const char* kScene = R"(
source: {kind: synthetic, figure: scalpel, scale: 0.29, depth_cameras: 0}
reconstruction: {resolution: 64}
bodies:
  - name: bar
    contact: false
    cuttable: true
    cut_capacity: 2000
    shape: {kind: box, size_m: [0.06, 0.06, 0.045]}
    placement: {position_m: [0.1, 0.44, 0]}
    spacing_m: 0.015
    material: {model: tled, young_modulus_pa: 30000, poisson_ratio: 0.4}
    fixed: [{kind: half_space, point_m: [0, -0.02, 0], normal: [0, 1, 0]}]
blades:
  - name: scalpel
    tracked: {model: scalpel}
)";

struct Played {
  std::vector<CutScore> cuts;
  std::vector<Notice> notices;
  Index most_vertices = 0;
  int known = 0;
  double worst_m = 0;       ///< error of the edge
  double worst_axis_m = 0;  ///< of the ends of the axis that pictures show
  float most_moved_m = 0;   ///< of nodes from rest
};

Played play(const Scene& scene, const NoiseOptions& noise, int frames) {
  DeviceSet devices("cpu", 3);
  SyntheticOptions options;
  options.figure = "scalpel";
  options.shape = {.moving = true, .scale = 0.29F};
  options.depth = options.truth = false;
  SyntheticSource source(options);
  Rig rig = source.rig();
  for (std::size_t c = 0; c < rig.cameras.size(); ++c)
    rig.cameras[c] = miscalibrate(rig.cameras[c], noise, static_cast<int>(c));
  test::FilmedWorld simulation(devices, scene, rig, {});
  const BladeModel model = built_in_scalpel();
  const std::array<Vec3d, 2> axis_m = BladeTracker(model, rig.cameras, {0, 0.5, 0}).axis_m();
  Played played;
  const std::vector<Vec3f> rest_m = simulation.bodies()[0]->positions_m(simulation.context());
  FrameSet frame;
  for (int k = 0; k < frames; ++k) {
    source.next(frame);
    for (std::size_t c = 0; c < rig.cameras.size(); ++c)
      disturb_mask(frame.silhouettes[c], noise, static_cast<int>(c), k);
    const StepReport report = simulation.step(frame, k > 0 ? 1.0 / 30 : 0);
    played.notices.insert(played.notices.end(), report.notices.begin(), report.notices.end());
    const std::vector<Vec3f> x_m = simulation.bodies()[0]->positions_m(simulation.context());
    for (std::size_t i = 0; i < rest_m.size() && k <= 25; ++i)
      played.most_moved_m = std::max(played.most_moved_m, length(x_m[i] - rest_m[i]));
    if (scene.blades.empty()) continue;
    const TrackedBlade& now = simulation.tracked_blades().now(0);
    if (now.is_seen()) played.most_vertices = std::max(played.most_vertices, report.hull.vertices);
    if (now.state != BladeState::known) continue;
    ++played.known;
    const Rigidf T = source.figure().bones(k / 30.0).front();
    for (std::size_t i = 0; i < model.edge_m.size(); ++i)
      played.worst_m =
          std::max(played.worst_m, static_cast<double>(length(now.edge_m[i] - T * model.edge_m[i])));
    const ToolAxis shown = simulation.snapshot().tools.at(0);
    EXPECT_EQ(shown.name, "scalpel");
    EXPECT_EQ(shown.two_sigma_m, now.two_sigma_m);
    for (const float off_m : {length(shown.from_m - T * vec_cast<float>(axis_m[0])),
                              length(shown.to_m - T * vec_cast<float>(axis_m[1]))})
      played.worst_axis_m = std::max(played.worst_axis_m, static_cast<double>(off_m));
  }
  played.cuts = simulation.cuts();
  return played;
}

/// The tool is found, cuts, and leaves no hull that could push.
TEST(TrackedBlade, CutsABodyByItsSilhouettes) {
  const Played played = play(parse_scene(kScene, "scenes/x.yaml"), {}, 45);
  EXPECT_GE(played.known, 38);
  EXPECT_LT(played.worst_m, 0.003);
  EXPECT_LT(played.worst_axis_m, 0.003);  // its ends are as far from the middle as the edge is
  EXPECT_LT(played.most_vertices, 20);
  ASSERT_EQ(played.cuts.size(), 1U);
  EXPECT_GT(played.cuts[0].area_m2, 1e-4);
}

/// 16 cm, along the handle.
TEST(TrackedBlade, ItsAxisGoesFromEndToEnd) {
  const SyntheticSource source({.figure = "scalpel", .depth = false, .truth = false});
  const auto [from_m, to_m] = BladeTracker(built_in_scalpel(), source.rig().cameras, {0, 0.5, 0}).axis_m();
  EXPECT_NEAR(length(to_m - from_m), 0.16, 0.003);
  EXPECT_GT(std::abs(normalized(to_m - from_m).x), 0.995);
}

/// Its pose comes from pictures alone: to the bit.
TEST(TrackedBlade, TheGridDoesNotMatter) {
  Scene scene = parse_scene(kScene, "scenes/x.yaml");
  const Played coarse = play(scene, {}, 15);
  scene.reconstruction.resolution = 160;
  const Played fine = play(scene, {}, 15);
  EXPECT_GT(coarse.worst_m, 0);
  EXPECT_EQ(coarse.worst_m, fine.worst_m);
  EXPECT_EQ(coarse.known, fine.known);
}

/// As its fat hull would: blade and handle go through the bar without moving it.
TEST(TrackedBlade, ItsHullPushesNothing) {
  Scene scene = parse_scene(kScene, "scenes/x.yaml");
  scene.blades[0].tracked->two_sigma_m = 0.0005;  // never known: it doesn't cut
  scene.bodies[0].contact = true;
  scene.gravity_m_s2 = {};
  scene.reconstruction.resolution = 160;
  EXPECT_LT(play(scene, {}, 26).most_moved_m, 0.05F * 0.015F);
  // The same cameras without a tracker: the hull pushes.
  scene.blades.clear();
  EXPECT_GT(play(scene, {}, 26).most_moved_m, 0.05F * 0.015F);
}

/// A bar that touches, without gravity, and exact masks of the scalpel at poses that a test gives.
struct Posed {
  DeviceSet devices{"cpu", 3};
  Rig rig;
  BladeModel model = built_in_scalpel();
  std::optional<test::FilmedWorld> simulation;
  int frames = 0;

  explicit Posed(const std::function<void(BodyDescription&)>& change) {
    Scene scene = parse_scene(kScene, "scenes/x.yaml");
    scene.bodies[0].contact = true;
    scene.blades[0].tracked->touches = true;
    scene.gravity_m_s2 = {};
    change(scene.bodies[0]);
    SyntheticOptions options;
    options.figure = "scalpel";
    options.depth = options.truth = false;
    rig = SyntheticSource(options).rig();
    simulation.emplace(devices, scene, rig, BodyAssets{});
  }
  /// Its blade is 38 mm before `handle_m`, the edge 8 mm below, along x; its flanks face z.
  StepReport step(Vec3d handle_m) {
    TriangleMesh posed = model.mesh;
    for (Vec3f& p : posed.positions_m) p += vec_cast<float>(handle_m);
    FrameSet frame;
    for (const Camera& camera : rig.cameras) frame.silhouettes.push_back(render_silhouette(posed, camera));
    return simulation->step(frame, frames++ > 0 ? 1.0 / 30 : 0);
  }
  SoftBody& body() { return *simulation->bodies()[0]; }
};

/// The scalpel goes down through a bar. Before a cube is cut through, its edge is up to a spacing deep in it,
/// and nothing moves. Then its flanks part the cut, by about the blade's thickness, 0.8 mm.
TEST(TrackedBlade, ItsFlanksOpenTheCutAndItsEdgePushesNothing) {
  constexpr float kWidth_m = 0.045F;
  Posed scene([&](BodyDescription& bar) {
    bar.shape.size_m = {0.0225, 0.06, double{kWidth_m}};
    bar.spacing_m = 0.0075;
  });
  const std::vector<Vec3f> rest_m = scene.body().positions_m(scene.simulation->context());
  float before_m = 0, opened_m = 0;
  Index touched = 0;
  for (int k = 0; k < 16; ++k) {
    const StepReport report = scene.step({0.138, 0.49 - 0.1 * k / 30, 0});
    for (const BodyContact& c : report.contacts)
      touched += c.component == "scalpel" ? c.reaction.contacts : 0;
    if (scene.simulation->cuts().empty()) {
      EXPECT_EQ(touched, 0);
      const std::vector<Vec3f> x_m = scene.body().positions_m(scene.simulation->context());
      for (std::size_t i = 0; i < x_m.size(); ++i) before_m = std::max(before_m, length(x_m[i] - rest_m[i]));
    }
    const Box3f box = bounds(scene.simulation->snapshot().bodies[0]);
    opened_m = std::max(opened_m, box.max.z - box.min.z - kWidth_m);
  }
  EXPECT_EQ(scene.simulation->tracked_blades().now(0).state, BladeState::known);
  EXPECT_EQ(scene.simulation->cuts().size(), 1U);
  EXPECT_LT(before_m, 0.05F * 0.0075F);
  EXPECT_GT(touched, 0);
  EXPECT_GT(opened_m, 0.0004F);
  EXPECT_LT(opened_m, 0.003F);  // 0.8 mm, and what the edge may be off by at either flank, 2 x 0.5 mm
}

/// Moved along the normal of its flank against a free bar, the scalpel gives it the momentum that it is said
/// to lose. Sums of 10,000 floats: 1e-4.
TEST(TrackedBlade, ItsFlankPushes) {
  Posed scene([](BodyDescription& bar) { bar.fixed.clear(); });
  Vec3d impulse_N_s{}, momentum_N_s{};
  for (int k = 0; k < 15; ++k) {
    const StepReport report = scene.step({0.142, 0.44, -0.045 + 0.1 * k / 30});  // the bar begins at -22.5 mm
    for (const BodyContact& contact : report.contacts) {
      EXPECT_EQ(contact.component, "scalpel");
      impulse_N_s += vec_cast<double>(contact.reaction.impulse_N_s);
    }
  }
  EXPECT_EQ(scene.simulation->tracked_blades().now(0).state, BladeState::known);
  EXPECT_TRUE(scene.simulation->cuts().empty());
  const std::vector<Vec3f> v_m_s = scene.body().velocities_m_s(scene.simulation->context());
  for (std::size_t i = 0; i < v_m_s.size(); ++i)
    momentum_N_s +=
        static_cast<double>(scene.body().shape().lattice.node_mass_kg[i]) * vec_cast<double>(v_m_s[i]);
  EXPECT_GT(momentum_N_s.z, 1e-3);
  EXPECT_NEAR(length(impulse_N_s + momentum_N_s), 0, 1e-4 * length(momentum_N_s));
}

TEST(TrackedBlade, RefusesWhatItDoesNotKnow) {
  Scene scene = parse_scene(kScene, "scenes/x.yaml");
  scene.blades[0].tracked->two_sigma_m = 0.0005;
  const Played played = play(scene, {}, 25);
  EXPECT_EQ(played.known, 0);
  EXPECT_TRUE(played.cuts.empty());
  EXPECT_EQ(std::count_if(played.notices.begin(), played.notices.end(),
                          [](const Notice& n) { return n.code == "blade.unsure"; }),
            1);
}

TEST(TrackedBlade, IsCheckedByName) {
  const auto expect = [](const char* instead, const char* part) {
    std::string text = kScene;
    text.replace(text.find("{model: scalpel}"), 16, instead);
    const std::string message =
        test::message_of([&] { parse_scene(text, "scenes/x.yaml"); }, ErrorKind::usage);
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  expect("{model: mesh}", "path");
  expect("{model: mesh, path: x.ply}", "expected two or more");
  expect("{model: scalpel, unit_m: 0.001}", "unit_m");
  expect("{model: scalpel, two_sigma_m: -1}", "two_sigma_m");
  expect("{model: scalpel}\n    to_m: [1, 0, 0]", "to_m");
  expect("{model: scalpl}", "scalpel");
  const auto markers = [](const std::string& list, const std::string& more = "") {
    return "{model: scalpel, markers: [" + list + "]" + more + "}";
  };
  const std::string good = "{id: 3, at: [0, 0, 0], right: [1, 0, 0], down: [0, -1, 0], size: 0.02}";
  expect(markers("{id: 50, at: [0, 0, 0], right: [1, 0, 0], down: [0, -1, 0], size: 0.02}").c_str(),
         "0 to 49");
  expect(markers("{id: 3, at: [0, 0, 0], right: [1, 0, 0], down: [1, -1, 0], size: 0.02}").c_str(),
         "right angles");
  expect(markers("{id: 3, at: [0, 0, 0], right: [1, 0, 0], down: [0, -1, 0]}").c_str(), "size");
  expect(markers(good, ", dictionary: 4X4_5").c_str(), "4X4_50");
  expect(markers(good + ", " + good).c_str(), "expected it once");
}

}  // namespace
}  // namespace tactus
