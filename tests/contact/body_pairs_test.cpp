// Bodies that touch one another, and themselves.
#include <gtest/gtest.h>

#include <cstdio>

#include "contact/pair_scene.h"
#include "support/device_sets.h"

namespace tactus {
namespace {

struct Collision {
  const char* name;
  bool first_matched, second_matched;
  float second_spacing_m;
};

void PrintTo(const Collision& c, std::ostream* out) { *out << c.name; }

class TwoBlocks : public ::testing::TestWithParam<Collision> {};
INSTANTIATE_TEST_SUITE_P(All, TwoBlocks,
                         ::testing::Values(Collision{"elements", false, false, 0.01F},
                                           Collision{"matched", true, true, 0.01F},
                                           Collision{"unequal", false, false, 0.006F},
                                           Collision{"mixed", false, true, 0.008F}),
                         [](const auto& i) { return i.param.name; });

/// One block of 6 cm flies at 1 m/s at another of the same size, shifted and turned a little, so that no
/// nodes meet.
TEST_P(TwoBlocks, MeetAtOneMetrePerSecond) {
  DeviceSet cpu("cpu");
  ExecContext& ctx = cpu.context(0);
  const float h = 0.01F, h2 = GetParam().second_spacing_m;
  const auto n2 = static_cast<Index>(0.06F / h2 + 0.5F);
  const test::SoftMaterial soft{.elastic = {.young_Pa = 2e4F, .poisson = 0.4F}};
  test::SoftMaterial first = soft, second = soft;
  first.matched = GetParam().first_matched;
  second.matched = GetParam().second_matched;
  test::SoftThing a = test::soft_box(ctx, {-0.065F, 0.003F, -0.002F}, {6, 6, 6}, h, first);
  test::SoftThing b = test::soft_box(ctx, {0, 0, 0}, {n2, n2, n2}, h2, second);
  a.launch(ctx, {1, 0, 0});
  test::PairScene scene(ctx, {&a, &b});
  const float dt = std::min(0.8F * scene.stable_step_s(), 5e-4F);
  const test::PairSums before = scene.sums();
  const bool has_elements = !first.matched && !second.matched;
  float deepest = 0;
  double most_J = 0, most_p = 0;
  for (int f = 0; f < 40; ++f) {
    scene.run(static_cast<int>(0.002F / dt), dt);
    const test::PairSums now = scene.sums();
    deepest = std::max(deepest, scene.deepest_m());
    most_J = std::max(most_J, has_elements ? now.energy_J : now.kinetic_J);
    most_p = std::max(most_p, length(now.momentum_kg_m_s - before.momentum_kg_m_s) / now.size_of_momentum);
  }
  const test::PairSums after = scene.sums();
  std::printf("deepest %.3f spacings, energy %.5f, at most %.5f, then %.5f J, dp %.2g, p of b %.3f of %.3f\n",
              static_cast<double>(deepest / h), before.energy_J, most_J,
              has_elements ? after.energy_J : after.kinetic_J, most_p, b.monitors(ctx).momentum_kg_m_s.x,
              before.momentum_kg_m_s.x);
  EXPECT_LE(deepest, 0.25F * std::min(h, h2));
  EXPECT_LE(most_p, 1e-6);
  EXPECT_LE(most_J, 1.001 * before.energy_J);
  EXPECT_GT(b.monitors(ctx).momentum_kg_m_s.x, 0.5 * before.momentum_kg_m_s.x) << "b was struck";
}

}  // namespace
}  // namespace tactus
