/// Liquid beside walls that blades cut.
#include <gtest/gtest.h>

#include <algorithm>

#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/geom/point_in_mesh.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic_source.h"
#include "tactus/sim/simulation.h"

namespace tactus {
namespace {

class Wounds : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(Wounds);

/// Liquid stands on a slab that is held at both ends and fills its box. Two blades cut a plug out of it, which
/// nothing holds up: walls that touch would close on particles, which have no room there.
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
contact: {cut_walls: false}
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
  Simulation simulation(devices, parse_scene(kPlug, "scenes/x.yaml"), make_synthetic_rig(), {});
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
  Simulation simulation(devices, scene, make_synthetic_rig(), {});
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
  EXPECT_EQ(simulation.bodies()[0]->cut_state(simulation.context()).parts, 2);
  EXPECT_LT(simulation.monitors().at(0).momentum_kg_m_s.y, -0.1 * all) << "it was hit";
}

}  // namespace
}  // namespace tactus
