/// A film on bodies: its ledger with the particles', cuts through it, checkpoints, and the same bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "tactus/geom/mesh/point_in_mesh.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

class FilmScene : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(FilmScene);

/// Blood lies on a slab that is held at both ends. From 0.1 to 0.2 s two blades cut a plug out of it, which
/// nothing holds up. The cut bleeds, and what falls leaves the box.
constexpr const char* kWetSlab = R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
bodies:
  - name: slab
    cuttable: true
    cut_capacity: 400
    bleeding: {rate_m_s: 0.01}
    shape: {kind: box, size_m: [0.2, 0.04, 0.08]}
    placement: {position_m: [0, 0.5, 0.6]}
    spacing_m: 0.02
    material: {model: tled, young_modulus_pa: 30000, poisson_ratio: 0.4, damping: 0.3}
    fixed:
      - {kind: half_space, point_m: [-0.07, 0, 0], normal: [1, 0, 0]}
      - {kind: half_space, point_m: [0.07, 0, 0], normal: [-1, 0, 0]}
blades:
  - {name: left, from_m: [-0.031, 0.56, 0.5], to_m: [-0.031, 0.56, 0.7], path: [{time_s: 0.1}, {time_s: 0.2, displacement_m: [0.001, -0.12, 0]}]}
  - {name: right, from_m: [0.032, 0.56, 0.5], to_m: [0.032, 0.56, 0.7], path: [{time_s: 0.1}, {time_s: 0.2, displacement_m: [0, -0.12, 0]}]}
fluid:
  spacing_m: 0.005
  film: true
  box: {min_m: [-0.15, 0.35, 0.5], max_m: [0.15, 0.7, 0.7]}
  open: all
  blocks: [{min_m: [-0.06, 0.521, 0.57], max_m: [-0.02, 0.5311, 0.63]}]
  surface_tension_n_m: 0.056
  contact_angle_deg: 40
  max_speed_m_s: 2
)";

constexpr double kParticle_m3 = 1.25e-7;

class WetSlab {
 public:
  WetSlab(const Scene& scene, const std::string& devices)
      : devices_(devices, 5), world(devices_, scene, make_synthetic_rig(), {}) {}
  StepReport step() { return world.step(nullptr, 1.0 / 30); }
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

 public:
  test::FilmedWorld world;
};

Scene wet_slab() { return parse_scene(kWetSlab, "scenes/x.yaml"); }

struct Seen {
  std::vector<Vec3f> liquid_m, body_m;
  FilmThickness film;
  bool operator==(const Seen& b) const {
    return liquid_m == b.liquid_m && body_m == b.body_m && film.film_m == b.film.film_m &&
           film.stain_m == b.film.stain_m;
  }
};

Seen seen(test::FilmedWorld& world) {
  FrameSnapshot s = world.snapshot();
  return {std::move(s.liquid_m), std::move(s.bodies.at(0).positions_m), std::move(s.films.at(0))};
}

/// A film that gets thinner by 0.2 mm/s leaves a stain, which stays: after 0.5 s without wounds, the film has
/// lost more than a hundredth of its volume to it, and together they are what particles gave.
TEST(FilmSceneStain, WhatDriesStaysAsAStain) {
  Scene scene = wet_slab();
  scene.blades.clear();
  scene.fluid->film_drying_m_s = 2e-4;
  WetSlab slab(scene, "cpu");
  double stain_m3 = 0;
  SceneFilmReport film;
  for (int k = 0; k < 15; ++k) {
    film = slab.step().film;
    EXPECT_GE(film.stain_m3, stain_m3) << "frame " << k;
    stain_m3 = film.stain_m3;
  }
  EXPECT_GT(stain_m3, 0.01 * film.film_m3);
  const double given_m3 = kParticle_m3 * (static_cast<double>(film.taken) - static_cast<double>(film.given));
  EXPECT_NEAR(film.film_m3 + stain_m3, given_m3, 1e-6 * given_m3);
  double most_m = 0;
  const FrameSnapshot last = slab.world.snapshot();
  for (const float m : last.films.at(0).stain_m) most_m = std::max(most_m, double{m});
  EXPECT_GT(most_m, 1e-5);
  EXPECT_LT(most_m, 2e-4 * 0.5 + 1e-9) << "no vertex dries faster";
}

/// What was placed and what wounds were due are the particles, the film, the stain, what waits, and what left
/// the box: in every frame, while a cut goes through the film and wounds bleed into it. All but the wounds'
/// due volume are integers; that is in 2^-32 particles, and doubles: 1e-6 is far above their rounding.
TEST_P(FilmScene, TheLedgerIsExactThroughACut) {
  WetSlab slab(wet_slab(), GetParam());
  double wettest_m3 = 0;
  StepReport report;
  for (int k = 0; k < 24; ++k) {
    report = slab.step();
    const LiquidReport& l = report.liquid;
    const SceneFilmReport& film = report.film;
    double due_m3 = kParticle_m3 * l.placed;
    for (const CutScore& cut : slab.world.cuts()) due_m3 += cut.due_m3;
    const double left = static_cast<double>(l.taken) - static_cast<double>(film.taken) + l.replaced;
    const double found_m3 =
        kParticle_m3 * (l.here + left) + film.film_m3 + film.stain_m3 + report.liquid_waiting_m3;
    EXPECT_NEAR(found_m3, due_m3, 1e-6 * due_m3) << "frame " << k;
    EXPECT_NEAR(film.film_m3 + film.stain_m3,
                kParticle_m3 * (static_cast<double>(film.taken) - static_cast<double>(film.given)),
                1e-6 * due_m3);
    wettest_m3 = std::max(wettest_m3, film.film_m3);
  }
  ASSERT_EQ(slab.world.cuts().size(), 2U) << "it was cut";
  EXPECT_GT(wettest_m3, 0.3 * kParticle_m3 * report.liquid.placed) << "the film holds a part of it";
  EXPECT_GT(report.liquid.emitted - report.film.given, 0U) << "it bled";
}

TEST_P(FilmScene, HasTheSameBits) {
  const auto play = [](const std::string& devices) {
    WetSlab slab(wet_slab(), devices);
    for (int k = 0; k < 12; ++k) slab.step();
    return seen(slab.world);
  };
  static const Seen on_cpu = play("cpu");
  EXPECT_TRUE(play(GetParam()) == on_cpu);
}

/// Five frames in which a film lies there and is cut, a checkpoint, five more, and bleeding begins: the same
/// as ten.
TEST_P(FilmScene, GoesOnFromACheckpoint) {
  WetSlab whole(wet_slab(), GetParam()), first(wet_slab(), GetParam()), second(wet_slab(), GetParam());
  for (int k = 0; k < 10; ++k) whole.step();
  for (int k = 0; k < 5; ++k) first.step();
  second.restore(first.archived());
  for (int k = 0; k < 5; ++k) second.step();
  const std::vector<float> film = seen(second.world).film.film_m;
  EXPECT_GT(std::count_if(film.begin(), film.end(), [](float m) { return m > 0; }), 10);
  EXPECT_TRUE(seen(second.world) == seen(whole.world));
  for (int k = 0; k < 6; ++k) {
    second.restore(second.archived());
    second.step();
    whole.step();
  }
  EXPECT_TRUE(seen(second.world) == seen(whole.world)) << "from a checkpoint in each frame, too";
}

/// The walls of a cut get wet from their own wounds: vertices that were not there before.
TEST(FilmScene, WoundsWetTheWallsOfTheirCut) {
  Scene scene = wet_slab();
  scene.fluid->blocks.clear();
  WetSlab slab(scene, "cpu");
  const std::size_t before = slab.world.bodies()[0]->shape().surface_m.positions_m.size();
  StepReport report;
  float deepest_m = 0;
  for (int k = 0; k < 20; ++k) {
    report = slab.step();
    const FrameSnapshot now = slab.world.snapshot();
    const PointInMesh body(now.bodies[0]);
    for (const Vec3f& x : now.liquid_m) deepest_m = std::max(deepest_m, -body.signed_distance_m(x));
  }
  // A wall that closes reaches over the particle beside it: without a film, 0.93 spacings.
  EXPECT_LT(deepest_m, 0.005F) << "what the film gives is in no wall";
  const std::vector<float> film = seen(slab.world).film.film_m;
  ASSERT_GT(film.size(), before);
  EXPECT_GT(report.film.film_m3, 5 * kParticle_m3);
  EXPECT_GT(std::count_if(film.begin() + static_cast<std::ptrdiff_t>(before), film.end(),
                          [](float m) { return m > 0; }),
            5);
}

TEST(FilmScene, IsOnByItselfWhereABodyBleedsALiquidWithSurfaceTension) {
  Scene scene = wet_slab();
  scene.fluid->film.reset();
  EXPECT_TRUE(has_film(scene));
  Scene dry = scene, slack = scene, compressible = scene, apart = scene;
  dry.bodies.front().bleeding.reset();
  slack.fluid->surface_tension_n_m = 0;
  compressible.fluid->solver = LiquidModel::wcsph;
  apart.bodies.front().contact = false;
  for (const Scene* other : {&dry, &slack, &compressible, &apart}) EXPECT_FALSE(has_film(*other));
}

TEST(FilmScene, IsOffWhereTheSceneSaysSo) {
  Scene scene = wet_slab();
  scene.fluid->film = false;
  WetSlab slab(scene, "cpu");
  EXPECT_EQ(slab.world.liquid()->film(), nullptr);
  EXPECT_TRUE(slab.world.snapshot().films.empty());
  EXPECT_EQ(slab.step().film.taken, 0U);
}

TEST(FilmScene, SaysThatNoBodyTouchesTheLiquid) {
  Scene scene = wet_slab();
  scene.bodies.front().contact = false;
  scene.bodies.front().bleeding.reset();
  WetSlab slab(scene, "cpu");
  const StepReport report = slab.step();
  EXPECT_EQ(std::count_if(report.notices.begin(), report.notices.end(),
                          [](const Notice& n) { return n.code == "liquid.no_film"; }),
            1);
}

}  // namespace
}  // namespace tactus
