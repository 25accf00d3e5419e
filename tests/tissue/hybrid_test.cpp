#include "tactus/tissue/hybrid/deflection_match.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/device_sets.h"
#include "tactus/base/error.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {
namespace {

constexpr float kH = 0.005F;
constexpr int kX = 0;
std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// 0.1 x 0.02 x 0.02 m, clamped at x = 0.
CubeLattice beam() {
  CubeLattice lattice = lattice_from_box({0, 0, 0}, {20, 4, 4}, {.spacing_m = kH});
  lattice.fix_half_space({0.01F * kH, 0, 0}, {1, 0, 0});
  return lattice;
}

constexpr ElasticMaterial kMaterial{.young_Pa = 30000, .poisson = 0.45F};
FlsmMaterial matched(int w) { return {.young_Pa = 30000, .half_width = w, .damping_ratio = 0.1F}; }

/// Elements from x = 0 for `elements` of the length, or from the far end with `at_far_end`.
ElementMask split(const CubeLattice& lattice, double elements, bool at_far_end = false) {
  ElementMask mask =
      split_by_ratio(lattice, kX, at_far_end ? 1 - elements : elements, at_far_end ? elements : 1 - elements);
  if (at_far_end)
    for (std::uint8_t& e : mask) e = e != 0 ? 0 : 1;
  return mask;
}

/// Displacement of the middle of the free end after settling under its weight.
Vec3f settled_tip(const CubeLattice& lattice, const ElementMask& mask, int w, float scale = 1) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  FlsmMaterial material = matched(w);
  material.stiffness_scale = scale;
  Hybrid hybrid(ctx, {.lattice = lattice,
                      .elements = mask,
                      .materials = {&kMaterial, 1},
                      .tled = {.damping_ratio = 0.1F},
                      .flsm = material});
  BodyState body = rest_state(ctx, lattice);
  const float dt = hybrid.stable_step_s();
  hybrid.step(ctx, body, {dt, {0, 0, -9.81F}, 20}, static_cast<int>(2.2F / dt));
  const auto x = to_host(ctx, body.x_m.const_view());
  for (Index i = 0; i < lattice.node_count(); ++i) {
    if (lattice.nodes[at(i)] == Vec3i{20, 2, 2}) return x[at(i)] - lattice.rest_m(i);
  }
  return {};
}

TEST(Hybrid, RatioSplitsNodes) {
  const CubeLattice lattice = beam();
  for (const auto& [a, b] : {std::pair{6.0, 4.0}, {7.0, 3.0}, {3.0, 7.0}}) {
    const ElementMask mask = split_by_ratio(lattice, kX, a, b);
    const LatticePart elements = lattice_part(lattice, [&](std::size_t c) { return mask[c] != 0; });
    const LatticePart rest = lattice_part(lattice, [&](std::size_t c) { return mask[c] == 0; });
    const double both = static_cast<double>(elements.node.size() + rest.node.size() - lattice.nodes.size());
    const double share =
        (static_cast<double>(elements.node.size()) - both / 2) / static_cast<double>(lattice.nodes.size());
    EXPECT_NEAR(share, a / (a + b), 0.5 / 21) << a;  // half a layer of 21
    EXPECT_NEAR(elements.lattice.mass_kg() + rest.lattice.mass_kg(), lattice.mass_kg(),
                1e-6 * lattice.mass_kg());
  }
  EXPECT_EQ(split_by_ratio(lattice, kX, 1, 0), ElementMask(lattice.cubes.size(), 1));
  EXPECT_EQ(split_by_ratio(lattice, kX, 0, 1), ElementMask(lattice.cubes.size(), 0));
  EXPECT_THROW(split_by_ratio(lattice, 3, 1, 1), Error);
  EXPECT_THROW(split_by_ratio(lattice, 0, 0, 0), Error);
}

/// All elements is Tled, bit for bit; all matched is Flsm but for the order of two additions per step.
TEST(Hybrid, EndsAreTheTwoModels) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = beam();
  Hybrid all_elements(ctx, {.lattice = lattice, .materials = {&kMaterial, 1}, .flsm = matched(2)});
  Hybrid all_matched(
      ctx,
      {.lattice = lattice, .elements = split(lattice, 0), .materials = {&kMaterial, 1}, .flsm = matched(2)});
  EXPECT_FALSE(all_elements.flsm().has_value());
  EXPECT_FALSE(all_matched.has_elements());
  Tled tled(ctx, lattice, {&kMaterial, 1});
  Flsm flsm(ctx, lattice, matched(2));
  BodyState a = rest_state(ctx, lattice), b = rest_state(ctx, lattice), c = rest_state(ctx, lattice),
            d = rest_state(ctx, lattice);
  const float dt = tled.stable_step_s();
  for (int k = 0; k < 200; ++k) {
    all_elements.step(ctx, a, {.dt_s = dt});
    tled.step(ctx, b, {.dt_s = dt});
    all_matched.step(ctx, c, {.dt_s = dt});
    flsm.step(ctx, d, {.dt_s = dt});
  }
  EXPECT_EQ(to_host(ctx, a.x_m.const_view()), to_host(ctx, b.x_m.const_view()));
  const auto x = to_host(ctx, c.x_m.const_view()), y = to_host(ctx, d.x_m.const_view());
  // One rounding of v (below 1 m/s, 6e-8) a step for 200 steps of 0.3 ms, some ten times larger by
  // elasticity.
  for (std::size_t i = 0; i < x.size(); ++i) ASSERT_LT(length(x[i] - y[i]), 1e-6F);
}

/// A coupled beam bends nearly as one of elements alone: within 5 % where elements bear the load, within 15 %
/// where shape matching does, whose Poisson's ratio is not the material's and whose width is not that of an
/// element.
TEST(Hybrid, CoupledBeamBendsLikeOneOfElements) {
  const CubeLattice lattice = beam();
  const float reference = settled_tip(lattice, {}, 1).z;
  EXPECT_NEAR(reference, -0.0727F, 0.002F);
  for (int w = 1; w <= 3; ++w) {
    const float at_clamp = settled_tip(lattice, split(lattice, 0.6), w).z;
    const float at_tip = settled_tip(lattice, split(lattice, 0.6, true), w).z;
    std::printf(
        "w %d: tip over that of elements alone: elements at the clamp %.3f, shape matching there %.3f\n", w,
        at_clamp / reference, at_tip / reference);
    EXPECT_NEAR(at_clamp / reference, 1, 0.05) << w;
    EXPECT_NEAR(at_tip / reference, 1, 0.15) << w;
  }
}

/// One deflection test for small motion scales shape matching: where it bears the load, most or all of the
/// body being shape-matched, the tip is within 15 % of the elements' alone for large motion, too.
TEST(Hybrid, DeflectionTestMatchesTheElements) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = beam();
  const float reference = settled_tip(lattice, {}, 1).z;
  for (int w = 1; w <= 3; ++w) {
    for (const double elements : {0.6, 0.3, 0.0}) {
      const ElementMask mask = split(lattice, elements, true);
      const float scale = match_deflection(ctx,
                                           {.lattice = lattice,
                                            .elements = mask,
                                            .materials = {&kMaterial, 1},
                                            .tled = {.damping_ratio = 0.1F},
                                            .flsm = matched(w)},
                                           {0, 0, -1});
      const float scaled = settled_tip(lattice, mask, w, scale).z / reference;
      std::printf("w %d, %2.0f %% elements at the tip: scale %.3f, tip %.3f\n", w, 100 * elements,
                  static_cast<double>(scale), static_cast<double>(scaled));
      EXPECT_NEAR(scaled, 1, 0.05) << w << ' ' << elements;
    }
  }
  EXPECT_EQ(match_deflection(ctx, {.lattice = lattice, .materials = {&kMaterial, 1}, .flsm = matched(1)}), 1);
}

/// The interface is counted once: whatever the split, a hanging body weighs the same. At rest the clamped
/// nodes' pull is the weight of all that is free; measured by the momentum that a free body gains when the
/// clamp lets go.
TEST(Hybrid, AnySplitHasTheSameWeight) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  CubeLattice lattice = beam();
  std::fill(lattice.fixed.begin(), lattice.fixed.end(), std::uint8_t{0});
  for (const double elements : {1.0, 0.6, 0.3, 0.0}) {
    Hybrid hybrid(ctx, {.lattice = lattice,
                        .elements = split(lattice, elements),
                        .materials = {&kMaterial, 1},
                        .flsm = matched(2)});
    BodyState body = rest_state(ctx, lattice);
    const float dt = hybrid.stable_step_s();
    std::vector<Vec3f> v(lattice.nodes.size());
    for (std::size_t i = 0; i < v.size(); ++i)
      v[i].z = 0.02F * sqr(static_cast<float>(lattice.nodes[i].x) / 20);  // it rings
    body.v_m_s = to_device(ctx, v);
    const int steps = static_cast<int>(0.2F / dt);
    for (int k = 0; k < steps; ++k) hybrid.step(ctx, body, {.dt_s = dt});
    const auto after = to_host(ctx, body.v_m_s.const_view());
    Vec3d momentum{};
    for (std::size_t i = 0; i < v.size(); ++i)
      momentum += static_cast<double>(lattice.node_mass_kg[i]) * vec_cast<double>(after[i] - v[i]);
    const double weight = -momentum.y / (steps * static_cast<double>(dt));
    EXPECT_NEAR(weight / (9.81 * lattice.mass_kg()), 1, 1e-4) << elements;
  }
}

/// At rest under gravity the clamp bears the weight, whatever the split: what elements and shape matching
/// pull at the held nodes is the weight of all that is free. Settled to 1e-3 of g (drag 20/s leaves e^-25 of
/// the fall).
TEST(Hybrid, AnySplitHasTheSameReaction) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const CubeLattice lattice = beam();
  double free_kg = 0;
  for (std::size_t i = 0; i < lattice.nodes.size(); ++i)
    free_kg += lattice.fixed[i] != 0 ? 0 : static_cast<double>(lattice.node_mass_kg[i]);
  for (const double elements : {1.0, 0.6, 0.3}) {
    Hybrid hybrid(ctx, {.lattice = lattice,
                        .elements = split(lattice, elements),
                        .materials = {&kMaterial, 1},
                        .tled = {.damping_ratio = 0.1F},
                        .flsm = matched(2)});
    BodyState body = rest_state(ctx, lattice);
    const float dt = hybrid.stable_step_s();
    const BodyStep step{dt, {0, 0, -9.81F}, 20};
    hybrid.step(ctx, body, step, static_cast<int>(2.5F / dt));
    hybrid.tled().compute_forces(ctx, body);
    const std::vector<Vec3f> f = hybrid.tled().forces_N(ctx);
    Vec3d reaction{};
    for (std::size_t i = 0; i < f.size(); ++i)
      if (lattice.fixed[i] != 0) reaction += vec_cast<double>(f[i]);
    // Held nodes are pulled down by what hangs on them.
    EXPECT_NEAR(-reaction.z / (9.81 * free_kg), 1, 2e-3) << elements;
    EXPECT_LT(std::abs(reaction.x), 2e-3 * 9.81 * free_kg) << elements;
  }
}

/// No damping, no gravity: inner forces and goals come in pairs.
TEST(Hybrid, FreeBodyKeepsItsMomentum) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  CubeLattice lattice = beam();
  std::fill(lattice.fixed.begin(), lattice.fixed.end(), std::uint8_t{0});
  FlsmMaterial undamped = matched(2);
  undamped.damping_ratio = 0;
  Hybrid hybrid(ctx, {.lattice = lattice,
                      .elements = split(lattice, 0.6),
                      .materials = {&kMaterial, 1},
                      .tled = {.damping_ratio = 0},
                      .flsm = undamped});
  BodyState body = rest_state(ctx, lattice);
  std::vector<Vec3f> v(lattice.nodes.size(), Vec3f{0.5F, 0, 0});
  for (std::size_t i = 0; i < v.size(); ++i) v[i].z = 0.05F * static_cast<float>(lattice.nodes[i].x % 7);
  body.v_m_s = to_device(ctx, v);
  const float dt = hybrid.stable_step_s();
  const int steps = static_cast<int>(1 / dt);
  for (int k = 0; k < steps; ++k) hybrid.step(ctx, body, {dt, {}});
  const auto after = to_host(ctx, body.v_m_s.const_view());
  Vec3d change{};
  double largest = 0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    change += static_cast<double>(lattice.node_mass_kg[i]) * vec_cast<double>(after[i] - v[i]);
    largest = std::max(largest, static_cast<double>(length(after[i])));
  }
  EXPECT_LT(largest, 3);
  EXPECT_LT(length(change) / (lattice.mass_kg() * largest), 1e-5);
}

class HybridDevices : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(HybridDevices);

TEST_P(HybridDevices, SameBitsAsOneCpu) {
  const CubeLattice lattice = beam();
  const auto run = [&](const std::string& devices) {
    DeviceSet set(devices, 11);
    ExecContext& ctx = set.context(0);
    Hybrid hybrid(ctx, {.lattice = lattice,
                        .elements = split(lattice, 0.4),
                        .materials = {&kMaterial, 1},
                        .flsm = matched(2)});
    BodyState body = rest_state(ctx, lattice);
    for (int k = 0; k < 60; ++k) hybrid.step(ctx, body, {.dt_s = hybrid.stable_step_s()});
    return to_host(ctx, body.x_m.const_view());
  };
  EXPECT_EQ(run(GetParam()), run("cpu"));
}

}  // namespace
}  // namespace tactus
