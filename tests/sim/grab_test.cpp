/// A body that is held at a point and pulled.
#include <gtest/gtest.h>

#include <cmath>

#include "support/device_sets.h"
#include "support/message_of.h"
#include "support/sliced_block.h"
#include "tactus/base/error.h"
#include "tactus/io/scene_file.h"
#include "tactus/sim/body/body_cuts.h"
#include "tactus/sim/body/soft_body.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

constexpr double kFrame_s = 1.0 / 50;
constexpr double kMass_kg = 0.064;  // of 1000 kg/m^3

/// A free block of 4 cm.
Scene free_block(TissueModel model = TissueModel::flsm) {
  Scene scene;
  scene.source.kind = SourceKind::none;
  scene.gravity_m_s2 = {};
  BodyDescription& block = scene.bodies.emplace_back();
  block.name = "block";
  block.shape.kind = ShapeKind::box;
  block.shape.size_m = {0.04, 0.04, 0.04};
  block.spacing_m = 0.005;
  block.material.model = model;
  block.material.young_modulus_pa = 20000;
  if (model == TissueModel::hybrid) block.ratio = RatioDescription{1, 1, Axis::z};
  return scene;
}

Grab grab_of_top(Vec3d by_m, double stiffness_N_m) {
  Grab grab;
  grab.body = "block";
  grab.point_m = {0, 0.02, 0};
  grab.target_m = grab.point_m + by_m;
  grab.stiffness_N_m = stiffness_N_m;
  return grab;
}

void play(World& world, int frames) {
  for (int f = 0; f < frames; ++f) world.step(kFrame_s);
}

/// It hangs at rest: the spring carries the weight, so the tissue that is held sags by m g / k. Two springs
/// differ by that of 1 / k. The stiffer one also keeps the held tissue more in shape, by a part of the
/// block's own stretch, rho g L^2 / 2 E = 0.4 mm: a quarter of it is tolerated. Drag of 10 / s leaves e^-20
/// of the motion after 4 s.
TEST(Grab, HoldsABlockAtItsWeightOverTheStiffness) {
  DeviceSet devices("cpu");
  const double weight_N = 9.81 * kMass_kg;
  double center_m[2] = {};
  const double stiffness_N_m[2] = {60, 120};
  for (int k = 0; k < 2; ++k) {
    Scene scene = free_block();
    scene.gravity_m_s2 = {0, -9.81, 0};
    scene.bodies[0].material.drag_per_s = 10;
    World world(devices, scene, {});
    world.set_grab(grab_of_top({}, stiffness_N_m[k]));
    play(world, 200);
    const StepReport report = world.step(kFrame_s);
    // Drag acts on velocities after gravity: of each substep's g dt a share of 10 / s dt is gone.
    const double pulled_N = weight_N * (1 - 10 * kFrame_s / report.substeps);
    EXPECT_NEAR(report.grab_N.y, pulled_N, 1e-3 * weight_N);
    EXPECT_NEAR(length(Vec3d{report.grab_N.x, 0, report.grab_N.z}), 0, 1e-3 * weight_N);
    center_m[k] = world.impl().bodies()[0]->status().motion.center_m.y;
    EXPECT_LT(center_m[k], -weight_N / stiffness_N_m[k]) << "the block itself stretches, too";
  }
  const double sag_m = weight_N * (1 / stiffness_N_m[0] - 1 / stiffness_N_m[1]);
  EXPECT_NEAR(center_m[1] - center_m[0], sag_m, 1e-4);
}

class GrabOn : public ::testing::TestWithParam<std::string> {};
TACTUS_INSTANTIATE_DEVICES(GrabOn);

/// The block gets the impulse of the spring and keeps it once it is let go. Impulses are summed in float over
/// some 200 nodes and 100 substeps: at most 20,000 roundings of 6e-8, which are of either sign, 1e-4.
TEST_P(GrabOn, GivesTheBlockItsImpulse) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  DeviceSet devices(GetParam());
  for (const TissueModel model : {TissueModel::flsm, TissueModel::tled, TissueModel::hybrid}) {
    World world(devices, free_block(model), {});
    Vec3d given{};
    world.set_grab(grab_of_top({0.01, 0.02, -0.01}, 40));
    for (int f = 0; f < 5; ++f) given += kFrame_s * world.step(kFrame_s).grab_N;
    EXPECT_GT(given.y, 0.005);
    const auto momentum = [&] { return world.monitors()[0].momentum_kg_m_s; };
    EXPECT_LT(length(momentum() - given), 1e-4 * length(given));
    world.set_grab(std::nullopt);
    const Vec3d before = momentum();
    EXPECT_EQ(length(world.step(kFrame_s).grab_N), 0);
    play(world, 4);
    EXPECT_LT(length(momentum() - before), 1e-4 * length(before)) << "nothing acts any more";
  }
}

/// Any number of devices gives the bits of one, for all solvers.
TEST_P(GrabOn, GivesTheSameBits) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  DeviceSet devices(GetParam()), one("cpu");
  for (const TissueModel model : {TissueModel::flsm, TissueModel::tled, TissueModel::hybrid}) {
    World a(devices, free_block(model), {}), b(one, free_block(model), {});
    for (World* world : {&a, &b}) {
      world->set_grab(grab_of_top({0.01, 0.02, -0.01}, 400));
      play(*world, 6);
    }
    EXPECT_EQ(a.impl().bodies()[0]->positions_m(a.impl().context()),
              b.impl().bodies()[0]->positions_m(b.impl().context()));
  }
}

/// A run that goes on from the middle of a pull gives the same bits.
TEST_P(GrabOn, GoesOnFromAnArchive) {
  TACTUS_SKIP_WITHOUT_DEVICES(GetParam());
  DeviceSet devices(GetParam());
  World whole(devices, free_block(), {}), again(devices, free_block(), {});
  whole.set_grab(grab_of_top({0.01, 0.02, -0.01}, 400));
  play(whole, 4);
  const std::string kept = whole.save_state();
  play(whole, 3);
  again.load_state(kept);
  play(again, 3);
  EXPECT_EQ(again.impl().bodies()[0]->positions_m(again.impl().context()),
            whole.impl().bodies()[0]->positions_m(whole.impl().context()));
}

/// A target far away, and springs from soft to a million times stiffer than the block: the force is the
/// bound, and the block stays in one piece.
TEST(Grab, IsBoundedAndStableAtAnyStiffness) {
  DeviceSet devices("cpu");
  for (const double stiffness_N_m : {1e3, 1e6, 1e9}) {
    World world(devices, free_block(TissueModel::tled), {});
    Grab grab = grab_of_top({0, 3, 0}, stiffness_N_m);
    grab.max_force_N = 0.5;
    world.set_grab(grab);
    for (int f = 0; f < 5; ++f) EXPECT_NEAR(world.step(kFrame_s).grab_N.y, 0.5, 5e-4);
    grab.target_m = grab.point_m + Vec3d{0, 0.03, 0};  // it comes to rest there
    grab.max_force_N = 5;
    world.set_grab(grab);
    for (int f = 0; f < 20; ++f) {
      const StepReport report = world.step(kFrame_s);
      for (const Notice& notice : report.notices) EXPECT_NE(notice.code, "body.blew_up") << notice.text;
    }
    EXPECT_LT(std::abs(world.impl().bodies()[0]->status().motion.center_m.y), 0.1);
  }
}

/// The block hangs from its top and is severed while its lower part is held: that part alone follows.
TEST(Grab, StaysOnItsSideOfACut) {
  Scene scene = parse_scene(kSlicedBlock, "scenes/x.yaml");
  scene.source.kind = SourceKind::none;
  scene.gravity_m_s2 = {};
  scene.bodies[0].contact = true;
  DeviceSet devices("cpu");
  World world(devices, scene, {});
  Grab grab;
  grab.body = "block";
  grab.point_m = {0, 0.5375, 0.55};  // on its front, in the layer of cubes below the blade's
  grab.target_m = grab.point_m - Vec3d{0, 0.05, 0};
  grab.stiffness_N_m = 20;
  world.set_grab(grab);
  for (int f = 0; f < 40; ++f) world.step(f > 0 ? 1.0 / 30 : 0);
  const SoftBody& block = *world.impl().bodies()[0];
  ASSERT_EQ(world.impl().bodies()[0]->cuts()->state(world.impl().context()).parts, 2);
  const std::vector<Vec3f> x_m = block.positions_m(world.impl().context());
  const CubeLattice& lattice = block.shape().lattice;
  double moved_m[2] = {}, mass_kg[2] = {};
  for (Index node = 0; node < lattice.node_count(); ++node) {
    const auto i = static_cast<std::size_t>(node);
    const float m = lattice.node_mass_kg[i], from_y = lattice.rest_m(node).y;
    if (!(m > 0) || (from_y > 0.54F && from_y < 0.59F)) continue;
    const std::size_t part = from_y < 0.56F ? 0 : 1;
    moved_m[part] += double{m} * double{x_m[i].y - from_y};
    mass_kg[part] += double{m};
  }
  EXPECT_LT(moved_m[0] / mass_kg[0], -0.02);
  EXPECT_LT(std::abs(moved_m[1] / mass_kg[1]), 0.005);
}

TEST(Grab, RefusesWhatCannotBe) {
  Scene scene = free_block();
  BodyDescription& ghost = scene.bodies.emplace_back(scene.bodies[0]);
  ghost.name = "ghost";
  ghost.contact = false;
  ghost.placement.position_m = {1, 0, 0};
  DeviceSet devices("cpu");
  World world(devices, scene, {});
  const auto message = [&](const auto& change) {
    Grab grab = grab_of_top({}, 10);
    change(grab);
    return test::message_of([&] { world.set_grab(grab); }, ErrorKind::usage);
  };
  EXPECT_EQ(message([](Grab& g) { g.body = "blok"; }),
            "grab: there is no body 'blok'; did you mean 'block'?");
  EXPECT_EQ(message([](Grab& g) { g.body = "ghost"; }),
            "grab: body 'ghost' has 'contact: false': nothing touches it");
  EXPECT_EQ(message([](Grab& g) { g.point_m.y = 0.12; }),
            "grab: point_m [0, 0.12, 0] is 0.1 m from body 'block', expected at most 0.01 m");
  EXPECT_EQ(message([](Grab& g) {
              g.target_m = {NAN, 0, 0};
            }),
            "grab: target_m is [nan, 0, 0], expected to be finite, and at most 1e6 m away");
  EXPECT_EQ(message([](Grab& g) {
              g.target_m = {1e30, 0, 0};
            }),
            "grab: target_m is [1e+30, 0, 0], expected to be finite, and at most 1e6 m away");
  EXPECT_EQ(message([](Grab& g) { g.stiffness_N_m = -1; }),
            "grab: stiffness_N_m is -1, expected > 0 and <= 1e12");
  EXPECT_EQ(message([](Grab& g) { g.stiffness_N_m = 1e300; }),
            "grab: stiffness_N_m is 1e+300, expected > 0 and <= 1e12");
  EXPECT_EQ(length(world.step(kFrame_s).grab_N), 0) << "none of them was taken";
}

}  // namespace
}  // namespace tactus
