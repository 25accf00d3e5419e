/// Liquid beside walls that blades cut.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "support/device_sets.h"
#include "support/filmed_world.h"
#include "support/message_of.h"
#include "tactus/geom/mesh/point_in_mesh.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/sim/body/body_cuts.h"

namespace tactus {
namespace {

class Wounds : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(Wounds);

/// Liquid stands on a slab that is held at both ends and fills its box. Two blades cut a plug out of it,
/// which nothing holds up.
constexpr const char* kPlug = R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
bodies:
  - name: slab
    cuttable: true
    cut_room: 400
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
  spacing_m: 0.01
  box: {min_m: [-0.1, 0.1, 0.56], max_m: [0.1, 0.7, 0.64]}
  blocks: [{min_m: [-0.1, 0.525, 0.56], max_m: [0.1, 0.555, 0.64]}]
  max_speed_m_s: 3
)";

struct Flowed {
  std::vector<Vec3f> before_m, after_m;
  float deepest_m = 0;
};

Flowed flow(const std::string& devices_text) {
  DeviceSet devices(devices_text, 5);
  test::FilmedWorld simulation(devices, parse_scene(kPlug, "scenes/x.yaml"), make_synthetic_rig(), {});
  Flowed flowed;
  for (int k = 0; k < 21; ++k) {
    simulation.step(nullptr, 1.0 / 30);
    const FrameSnapshot seen = simulation.snapshot();
    if (k == 2) flowed.before_m = seen.liquid_m;
    flowed.after_m = seen.liquid_m;
    const PointInMesh slab(seen.bodies[0]);
    for (const Vec3f& x : seen.liquid_m)
      flowed.deepest_m = std::max(flowed.deepest_m, -slab.signed_distance_m(x));
  }
  return flowed;
}

/// Of what stood on the slab before it was cut, what stood over the plug, which is 0.3 of it, and more is
/// below it 0.5 s later: it fell past the walls of the cut, and into none of them.
TEST_P(Wounds, LiquidFallsPastTheWallsOfACut) {
  static const Flowed on_cpu = flow("cpu");
  const Flowed got = flow(GetParam());
  EXPECT_TRUE(got.before_m == on_cpu.before_m && got.after_m == on_cpu.after_m) << "the same bits";
  const auto below = [](const std::vector<Vec3f>& all) {
    return std::count_if(all.begin(), all.end(), [](Vec3f x) { return x.y < 0.48F; });
  };
  ASSERT_EQ(got.before_m.size(), 20U * 3 * 8);
  EXPECT_EQ(below(got.before_m), 0);
  EXPECT_EQ(got.after_m.size(), got.before_m.size()) << "none is lost";
  EXPECT_GT(below(got.after_m), 0.3 * static_cast<double>(got.before_m.size()));
  EXPECT_LT(got.deepest_m, 0.5F * 0.01F);
}

/// A drop falls into the two halves of a body that floats freely. They keep their momentum, to the rounding
/// of floats in 400 steps: 1e-5 of all momenta.
TEST(WoundScene, ADropBetweenTwoHalvesKeepsMomentum) {
  Scene scene = parse_scene(R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
gravity_m_s2: [0, 0, 0]
bodies:
  - name: block
    cuttable: true
    shape: {kind: box, size_m: [0.12, 0.06, 0.12]}
    placement: {position_m: [0, 0.3, 0.6]}
    spacing_m: 0.01
    material: {model: tled, young_modulus_pa: 20000, density_kg_m3: 1000, damping: 0.1}
blades:
  - {name: slicer, from_m: [0.002, 0.36, 0.5], to_m: [0.002, 0.36, 0.7], path: [{time_s: 0.01}, {time_s: 0.04, displacement_m: [0, -0.14, 0]}]}
fluid:
  spacing_m: 0.01
  density_kg_m3: 1000
  box: {min_m: [-0.5, 0, 0.1], max_m: [0.5, 1, 1.1]}
  blocks: [{min_m: [-0.02, 0.41, 0.58], max_m: [0.02, 0.45, 0.62], velocity_m_s: [0.1, -1, 0]}]
  max_speed_m_s: 2
)",
                            "scenes/x.yaml");
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  const auto momentum = [&](double& all) {
    all = 0;
    Vec3d sum = simulation.monitors().at(0).momentum_kg_m_s;
    for (const LiquidParticle& p : simulation.liquid()->liquid().particles()) {
      sum += 1e-3 * vec_cast<double>(p.v_m_s);
      all += 1e-3 * double{length(p.v_m_s)};
    }
    return sum;
  };
  simulation.step(nullptr, 0);
  double all = 0, rest = 0;
  const Vec3d before = momentum(all);
  for (int k = 0; k < 8; ++k) {
    simulation.step(nullptr, 1.0 / 30);
    EXPECT_LT(length(momentum(rest) - before), 1e-5 * all) << "frame " << k;
  }
  EXPECT_EQ(simulation.bodies()[0]->cuts()->state(simulation.context()).parts, 2);
  EXPECT_LT(simulation.monitors().at(0).momentum_kg_m_s.y, -0.1 * all) << "it was hit";
}

/// The slab, without the liquid on it, bleeds. @param more of the body, into its mapping
Scene bleeding_slab(const std::string& more) {
  std::string text = kPlug;
  const auto replace = [&](const std::string& what, const std::string& with) {
    const std::size_t place = text.find(what);
    EXPECT_NE(place, std::string::npos) << what;
    text.replace(place, what.size(), with);
  };
  replace("    cut_room: 400\n", "    cut_room: 400\n" + more + "\n");
  replace("  blocks: [{min_m: [-0.1, 0.525, 0.56], max_m: [0.1, 0.555, 0.64]}]\n", "");
  return parse_scene(text, "scenes/x.yaml");
}

struct Bled {
  std::vector<Vec3f> liquid_m;
  std::vector<Vec3f> first_m;  ///< where each particle was seen first
  std::vector<CutScore> cuts;
  LiquidReport liquid;
  double expected_m3 = 0;  ///< rate x area x time
};

/// @param beats_1_s, share of a pulse
Bled bleed(const Scene& scene, const std::string& devices_text, int frames, double rate_m_s,
           double dt_s = 1.0 / 30, double beats_1_s = 0, double share = 0) {
  const double w = 2 * std::numbers::pi * beats_1_s;
  const auto beaten = [&](double t_s) {
    return beats_1_s > 0 ? t_s + share / w * (1 - std::cos(w * t_s)) : t_s;
  };
  DeviceSet devices(devices_text, 5);
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  Bled bled;
  for (int k = 0; k < frames; ++k) {
    // What was cut until now bleeds in the coming frame, on both sides.
    if (k > 0)
      for (const CutScore& cut : bled.cuts)
        bled.expected_m3 += 2 * rate_m_s * cut.area_m2 * (beaten((k + 1) * dt_s) - beaten(k * dt_s));
    bled.liquid = simulation.step(nullptr, dt_s).liquid;
    bled.cuts = simulation.cuts();
    for (const LiquidParticle& p : simulation.liquid()->liquid().particles()) {
      if (p.id < static_cast<Index>(bled.first_m.size())) continue;
      bled.first_m.resize(static_cast<std::size_t>(p.id) + 1);
      bled.first_m.back() = p.x_m;
    }
  }
  bled.liquid_m = simulation.snapshot().liquid_m;
  return bled;
}

constexpr double kParticle_m3 = 1e-6;  // of 1 cm

/// Two strokes make wounds that gape, as the plug between them falls. What is due is rate times area times
/// time: to rounding of floats, 1e-4 with as many sums. Of that, all that is a whole particle came out, but
/// for what came due while all places were taken: at most 1 % and one particle per stroke.
TEST_P(Wounds, BleedByRateAreaAndTime) {
  const Scene scene = bleeding_slab("    bleeding: {rate_m_s: 0.02}");
  static const Bled on_cpu = bleed(scene, "cpu", 20, 0.02);
  const Bled got = bleed(scene, GetParam(), 20, 0.02);
  EXPECT_TRUE(got.liquid_m == on_cpu.liquid_m) << "the same bits";
  ASSERT_EQ(got.cuts.size(), 2U);
  double due_m3 = 0, bled_m3 = 0;
  for (const CutScore& cut : got.cuts) {
    // The slab sags between its ends before it is cut, as a clamped beam: w = 31 N/m, L = 0.14 m and
    // E I = 0.0128 N m^2 give w L^4 / (384 E I) = 2.4 mm, and a slope of 0.048 at the blades. So what is
    // upright in the world is longer by 1 / cos(0.048) at rest. Without gravity the areas are right to 3e-5.
    const double area_m2 = 0.04 * 0.08 * 1.00115;
    EXPECT_NEAR(cut.area_m2, area_m2, 1e-3 * area_m2);
    due_m3 += cut.due_m3;
    bled_m3 += cut.bled_m3;
    EXPECT_LE(cut.bled_m3, cut.due_m3 * (1 + 1e-9));
    EXPECT_GT(cut.bled_m3, 0.99 * cut.due_m3 - kParticle_m3);
  }
  EXPECT_NEAR(due_m3, got.expected_m3, 1e-4 * got.expected_m3);
  EXPECT_NEAR(bled_m3, kParticle_m3 * got.liquid.emitted, 1e-3 * kParticle_m3);
  EXPECT_EQ(got.liquid.emitted, static_cast<std::uint32_t>(got.liquid.here) + got.liquid.taken);
}

/// The same with a pulse: what is due follows the integral of 1 + share sin(2 pi beats t), to 1e-4 as above
/// (the sine's own error is 4e-6). 20 frames are 0.67 s, 1.07 of a beat of 96 a minute; after half a beat it
/// is 1 + 2 share / pi = 1.57 times the even rate.
TEST_P(Wounds, BleedInBeatsOfTheHeart) {
  const Scene scene = bleeding_slab("    bleeding: {rate_m_s: 0.02, pulse_per_min: 96, pulse_share: 0.9}");
  static const Bled on_cpu = bleed(scene, "cpu", 20, 0.02, 1.0 / 30, 1.6, 0.9);
  for (const int frames : {10, 20}) {
    const Bled got = bleed(scene, GetParam(), frames, 0.02, 1.0 / 30, 1.6, 0.9);
    double due_m3 = 0;
    for (const CutScore& cut : got.cuts) due_m3 += cut.due_m3;
    EXPECT_NEAR(due_m3, got.expected_m3, 1e-4 * got.expected_m3) << frames << " frames";
    if (frames == 20) {
      EXPECT_TRUE(got.liquid_m == on_cpu.liquid_m) << "the same bits";
    }
  }
}

/// Half of each wall bleeds, and less and less: over t, T (1 - e^(-t/T)) instead of t. Each component began
/// within the 0.1 s that the stroke took, in steps of frames: that mean is known to a frame, 0.033 of 0.47 s.
TEST(WoundScene, ARegionHasAFactorAndBleedingFades) {
  const Scene half = bleeding_slab(
      "    bleeding: {rate_m_s: 0.02, fading_s: 0.3}\n"
      "    regions: [{kind: half_space, frame: world, point_m: [0, 0, 0.6], normal: [0, 0, 1], bleeding: "
      "0}]");
  const Bled got = bleed(half, "cpu", 20, 0.02);
  ASSERT_EQ(got.cuts.size(), 2U);
  for (const CutScore& cut : got.cuts) {
    const double t_s = 20.0 / 30 - 0.5 * (cut.begin_s + cut.end_s) - 0.5 / 30;
    const auto faded = [](double t) { return 0.3 * (1 - std::exp(-t / 0.3)); };
    EXPECT_GT(cut.due_m3, 0.02 * cut.area_m2 * faded(t_s - 0.034));
    EXPECT_LT(cut.due_m3, 0.02 * cut.area_m2 * faded(t_s + 0.034));
  }
}

/// A cut in a block that nothing opens bleeds at its rim alone: half a spacing, 5 mm, above the skin, beside
/// the cut. What comes from below has no room and waits. Until a particle is seen first, at the end of a
/// frame of 4 ms, those that came beside it push it aside by less than half a spacing.
TEST(WoundScene, AShutCutBleedsAtItsRim) {
  const Scene scene = parse_scene(R"(
source: {kind: synthetic, figure: sphere, depth_cameras: 0}
reconstruction: {resolution: 16}
gravity_m_s2: [0, 0, 0]
bodies:
  - name: block
    cuttable: true
    bleeding: {rate_m_s: 0.02}
    shape: {kind: box, size_m: [0.12, 0.12, 0.12]}
    placement: {position_m: [0, 0.3, 0.6]}
    spacing_m: 0.02
    material: {model: tled, young_modulus_pa: 20000, density_kg_m3: 1000, damping: 0.1}
    fixed: [{kind: half_space, point_m: [0, -0.05, 0], normal: [0, 1, 0]}]
blades:
  - {name: slicer, from_m: [0.002, 0.4, 0.56], to_m: [0.002, 0.4, 0.64], path: [{time_s: 0.01}, {time_s: 0.06, displacement_m: [0, -0.09, 0]}]}
fluid:
  spacing_m: 0.01
  box: {min_m: [-0.3, 0, 0.3], max_m: [0.3, 1, 0.9]}
  max_speed_m_s: 2
)",
                                  "scenes/x.yaml");
  const Bled got = bleed(scene, "cpu", 120, 0.02, 1.0 / 240);
  ASSERT_EQ(got.cuts.size(), 1U);
  EXPECT_NEAR(got.cuts[0].due_m3, got.expected_m3, 1e-4 * got.expected_m3);
  EXPECT_GT(got.liquid.emitted, 4U);
  EXPECT_GT(got.cuts[0].due_m3 - got.cuts[0].bled_m3, kParticle_m3) << "some of it has no room";
  for (const Vec3f& x : got.first_m) {
    EXPECT_GT(x.y, 0.36F);
    EXPECT_LT(std::abs(x.x - 0.002F), 0.01F);
    EXPECT_LT(std::abs(x.z - 0.6F), 0.04F + 0.01F);
  }
}

/// A wound owes 1 m/s. Places bring no more than a spacing in a frame, 0.3 m/s: the rest waits and is told,
/// and due = bled + waiting. Without gravity, what comes out has the speed of rate over area, 1 m/s, along
/// the normal of the wall, and what the wall moves adds to that.
TEST(WoundScene, TellsWhatWaitsAndShootsAsFastAsItBleeds) {
  Scene scene = bleeding_slab("    bleeding: {rate_m_s: 1}");
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, scene, make_synthetic_rig(), {});
  std::vector<Notice> notices;
  StepReport report;
  for (int k = 0; k < 10; ++k) {
    report = simulation.step(nullptr, 1.0 / 30);
    notices.insert(notices.end(), report.notices.begin(), report.notices.end());
  }
  double waiting_m3 = 0;
  for (const CutScore& cut : simulation.cuts()) waiting_m3 += cut.due_m3 - cut.bled_m3;
  EXPECT_GT(waiting_m3, 100 * kParticle_m3);
  EXPECT_NEAR(report.liquid_waiting_m3, waiting_m3, 1e-6 * waiting_m3);
  const auto is_late = [](const Notice& n) { return n.code == "liquid.wounds_wait"; };
  ASSERT_EQ(std::count_if(notices.begin(), notices.end(), is_late), 1);
  EXPECT_EQ(std::find_if(notices.begin(), notices.end(), is_late)->text,
            "body 'slab' bleeds 1 m/s (volume per time and area), but wounds can bring 0.3 m/s at most, one "
            "particle's spacing a frame: the rest waits");
}

TEST(WoundScene, RefusesBleedingByName) {
  const auto error_of = [](const std::string& what, const std::string& instead) {
    std::string text = kPlug;
    text.replace(text.find(what), what.size(), instead);
    return test::message_of([&] { parse_scene(text, "scenes/x.yaml"); }, ErrorKind::usage);
  };
  const std::string key = "    cuttable: true\n    cut_room: 400\n";
  const auto expect = [&](const std::string& instead, const char* part) {
    const std::string message = error_of(key, instead);
    EXPECT_NE(message.find(part), std::string::npos) << "[" << message << "] " << part;
  };
  expect("    bleeding: {rate_m_s: 0.01}\n", "'cuttable' is true");
  expect(key + "    bleeding: {}\n", "rate_m_s");
  expect(key + "    bleeding: {rate_m_s: 0}\n", "> 0");
  expect(key + "    bleeding: {rate_m_s: 0.01, fading_s: -1}\n", "fading_s");
  expect(key + "    bleeding: {rate_m_s: 0.01, fade_s: 1}\n", "fading_s");
  expect(key + "    bleeding: {rate_m_s: 0.01, pulse_per_min: 0}\n", "pulse_per_min");
  expect(key + "    bleeding: {rate_m_s: 0.01, pulse_share: 0.5}\n",
         "has no effect, it is for when 'pulse_per_min'");
  expect(key + "    bleeding: {rate_m_s: 0.01, pulse_per_min: 72, pulse_share: 1.5}\n", "pulse_share");
  expect(key + "    bleeding: {rate_m_s: 0.01}\n    contact: false\n", "contact: true");
  expect(key + "    regions: [{kind: sphere, radius_m: 0.1, bleeding: 2}]\n", "no 'bleeding' with a rate");
}

}  // namespace
}  // namespace tactus
