// An undamped bar that swings far keeps its energy, whatever steps frames take.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <vector>

#include "support/filmed_world.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/tissue/substep_choice.h"

namespace tactus {
namespace {

SpaceRegion half_space(Vec3d point_m, Vec3d out) {
  SpaceRegion region;
  region.kind = RegionKind::half_space;
  region.point_m = point_m;
  region.normal = out;
  return region;
}

/// Held at its left end; the right one is drawn aside and let go at 3 s.
Scene swinging_bar(double aside_m) {
  Scene scene;
  scene.reconstruction.resolution = 8;
  scene.gravity_m_s2 = {};
  BodyDescription bar;
  bar.name = "bar";
  bar.contact = false;
  bar.shape.size_m = {0.18, 0.03, 0.03};
  bar.spacing_m = 0.01;
  bar.material.model = TissueModel::tled;
  bar.material.young_modulus_pa = 15000;
  bar.material.poisson_ratio = 0.4;
  bar.material.damping = 0;
  bar.material.density_kg_m3 = 1050;
  bar.fixed.push_back({half_space({-0.0875, 0, 0}, {1, 0, 0})});
  MovedRegion& grip = bar.moved.emplace_back();
  grip.name = "grip";
  grip.where = half_space({0.0875, 0, 0}, {-1, 0, 0});
  grip.release_s = 3;
  for (const auto& [time_s, part] : {std::pair{0.6, 0.02}, std::pair{2.2, 0.98}, std::pair{2.8, 1.0}})
    grip.path.push_back({time_s, {0, -part * aside_m, 0}, 0});
  scene.bodies = {bar};
  return scene;
}

/// Change of its energy in 60 s, of means over a second.
double drift(double aside_m) {
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, swinging_bar(aside_m), make_synthetic_rig(), {});
  double early_J = 0, late_J = 0;
  for (int k = 0; k <= 63 * 30; ++k) {
    simulation.step(nullptr, k == 0 ? 0 : 1.0 / 30);
    if (k <= 95 || (k > 125 && k <= 62 * 30)) continue;
    const BodyMonitors m = simulation.monitors()[0];
    (k <= 125 ? early_J : late_J) += m.kinetic_J + m.elastic_J + m.hourglass_J;
  }
  return late_J / early_J - 1;
}

/// Steps of parts of frames changed with each part: +3 % at 50 mm, +10.6 % at 80 mm. What is left is what
/// goes over to modes that the step resolves badly.
TEST(IndependentEnergy, ASwingingBarKeepsItFor60Seconds) {
  for (const double aside_m : {0.05, 0.08}) {
    const double change = drift(aside_m);
    std::printf("drawn aside by %g m: %+.2f %% in 60 s\n", aside_m, 100 * change);
    EXPECT_LT(std::abs(change), 0.01);
  }
}

TEST(IndependentEnergy, PartsOfAFrameShareTheStep) {
  constexpr double kFrame_s = 1.0 / 30;
  SubstepChoice choice;
  EXPECT_EQ(choice.of_frame(kFrame_s, 30, 2000), 30);
  EXPECT_EQ(choice.of_part(kFrame_s, 29, 2000), 30);
  EXPECT_EQ(choice.of_part(kFrame_s, 36, 2000), 36) << "a need that grows";
  EXPECT_EQ(choice.of_frame(kFrame_s, 30, 2000), 36) << "is kept";
  EXPECT_EQ(choice.of_part(kFrame_s, 100, 2000), 100) << "a blow";
  EXPECT_EQ(choice.of_part(kFrame_s, 30, 2000), 36) << "is not";
  EXPECT_EQ(choice.of_part(kFrame_s, 30, 20), 20) << "what is left of the frame's most";
}

/// A live frame that comes 0.25 s late simulates 0.25 s, in steps as long as ever. (The number of substeps
/// was kept in place of their length: the 60 frames after it took seven times as long.)
TEST(IndependentEnergy, AFrameThatComesLateLeavesTheStep) {
  SubstepChoice choice;
  EXPECT_EQ(choice.of_frame(0.25, 240, 2000), 240);
  EXPECT_EQ(choice.of_frame(1.0 / 30, 32, 2000), 32);
  EXPECT_EQ(choice.of_frame(1.0 / 60, 16, 2000), 16);
  EXPECT_EQ(choice.of_part(1.0 / 30, 31, 2000), 32);
}

}  // namespace
}  // namespace tactus
