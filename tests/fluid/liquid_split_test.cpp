/// A liquid on several devices has the bits of the liquid on one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <set>
#include <string>

#include "support/device_sets.h"
#include "tactus/fluid/liquid.h"
#include "tactus/multi_device/device_replay.h"

namespace tactus {
namespace {

constexpr Vec3f kGravity{0, -9.81F, 0};
constexpr float kSpacing = 0.01F;

/// A dam at one end of a trough that ends in a sink, with a jet that has little capacity; along z for
/// `axis` 2. Some thin, or have a surface tension.
LiquidSettings trough(LiquidSolver solver, Index axis = 0) {
  LiquidSettings s{.solver = solver,
                   .iterations = 3,
                   .spacing_m = kSpacing,
                   .max_speed_m_s = 2,
                   .box_m = {{0, 0, 0}, {0.6F, 0.3F, 0.06F}},
                   .max_particles = 640,
                   .emitters = {{.position_m = {0.1F, 0.25F, 0.03F}, .radius_m = 0.02F, .until_s = 0.3}},
                   .sinks_m = {{{0.45F, -1, 0}, {0.6F, 1, 1}}},
                   .least_particles = 1};
  if (solver == LiquidSolver::wcsph || axis == 2) s.carreau = Carreau{};
  if (axis == 2) s.surface_tension_N_m = 0.06F;
  if (axis == 0) return s;
  std::swap(s.box_m.max.x, s.box_m.max.z);
  std::swap(s.emitters[0].position_m.x, s.emitters[0].position_m.z);
  s.sinks_m = {{{0, -1, 0.45F}, {1, 1, 0.6F}}};
  return s;
}
std::vector<LiquidParticle> dam(Index axis = 0) {
  const Vec3f size_m = axis == 0 ? Vec3f{0.1F, 0.1F, 0.06F} : Vec3f{0.06F, 0.1F, 0.1F};
  return fill_box({{0, 0, 0}, size_m}, kSpacing);
}

struct State {
  std::vector<LiquidParticle> particles;
  std::vector<float> densities;
  std::vector<Vec3f> impulses;
  LiquidReport report;
};

std::vector<std::vector<Index>> layers_of(DeviceSet& set, const Liquid& liquid) {
  std::vector<std::vector<Index>> layers;
  for (int p = 0; p < liquid.part_count(); ++p) layers.push_back(to_host(set.context(p), liquid.layers(p)));
  return layers;
}

State state_of(DeviceSet& set, Liquid& liquid) {
  liquid.end_frame();
  return {liquid.particles(), liquid.densities_kg_m3(), to_host(set.context(0), liquid.wall_impulses_N_s()),
          to_host(set.context(0), liquid.report_view())[0]};
}

void expect_same(const State& got, const State& expected, const std::string& when) {
  ASSERT_EQ(got.particles.size(), expected.particles.size()) << when;
  for (std::size_t i = 0; i < got.particles.size(); ++i) {
    ASSERT_EQ(got.particles[i].id, expected.particles[i].id) << when;
    ASSERT_EQ(got.particles[i].x_m, expected.particles[i].x_m) << when << ", particle " << i;
    ASSERT_EQ(got.particles[i].v_m_s, expected.particles[i].v_m_s) << when << ", particle " << i;
  }
  EXPECT_EQ(got.densities, expected.densities) << when;
  EXPECT_EQ(got.impulses, expected.impulses) << when;
  EXPECT_EQ(got.report.here, expected.report.here) << when;
  EXPECT_EQ(got.report.emitted, expected.report.emitted) << when;
  EXPECT_EQ(got.report.taken, expected.report.taken) << when;
  EXPECT_EQ(got.report.replaced, expected.report.replaced) << when;
  EXPECT_EQ(got.report.waiting, expected.report.waiting) << when;
  EXPECT_EQ(got.report.fast, expected.report.fast) << when;
  EXPECT_EQ(got.report.fastest_m_s, expected.report.fastest_m_s) << when;
  EXPECT_EQ(got.report.densest, expected.report.densest) << when;
}

struct Splash {
  std::vector<State> states;  ///< after each frame
  std::set<float> cuts;       ///< where the first was
  std::vector<int> most;      ///< per part, particles at the end of a frame
};

Splash splash(const std::string& devices, LiquidSolver solver, std::uint64_t seed, int frames,
              Index axis = 0) {
  DeviceSet set(devices, seed);
  Liquid liquid(set, trough(solver, axis));
  liquid.place(dam(axis));
  Splash made;
  made.most.resize(static_cast<std::size_t>(liquid.part_count()));
  const int steps = solver == LiquidSolver::dfsph ? 10 : 100;
  DeviceReplay frame_steps;
  for (int frame = 0; frame < frames; ++frame) {
    frame_steps.run(set, [&] {
      for (int i = 0; i < steps; ++i)
        liquid.step({.dt_s = liquid.largest_step_s(), .gravity_m_s2 = kGravity, .in_block = i});
    });
    made.states.push_back(state_of(set, liquid));
    const std::vector<std::vector<Index>> layers = layers_of(set, liquid);
    for (std::size_t p = 0; p < layers.size() && layers.size() > 1; ++p)
      made.most[p] =
          std::max(made.most[p],
                   std::accumulate(layers[p].begin(), layers[p].begin() + LiquidLayers::kLayers, Index{0}));
    made.cuts.insert(liquid.slabs().begin_m[1]);
    liquid.balance(layers);
  }
  return made;
}

class LiquidSplits : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(LiquidSplits);

/// A dam breaks over all cuts, which move with it; the oldest make way for a jet, and a sink takes what
/// comes. 300 steps of dfsph, 1500 of wcsph.
TEST_P(LiquidSplits, HasTheBitsOfOneDevice) {
  for (const LiquidSolver solver : {LiquidSolver::wcsph, LiquidSolver::dfsph}) {
    const int frames = solver == LiquidSolver::dfsph ? 30 : 15;
    static std::map<LiquidSolver, Splash> on_cpu;  // the same for all devices
    if (!on_cpu.contains(solver)) on_cpu[solver] = splash("cpu", solver, 0, frames);
    const Splash &expected = on_cpu[solver], got = splash(GetParam(), solver, 5, frames);
    ASSERT_EQ(got.states.size(), expected.states.size());
    for (std::size_t k = 0; k < got.states.size(); ++k) {
      expect_same(got.states[k], expected.states[k], "frame " + std::to_string(k));
      if (HasFatalFailure()) return;
    }
    EXPECT_GT(expected.states.back().report.taken, 0U) << "something reached the sink";
    EXPECT_GT(expected.states.back().report.replaced, 0U) << "there was no capacity for a while";
    if (got.most.size() == 1) continue;
    EXPECT_GT(got.cuts.size(), 3U) << "cuts moved";
    for (const int most : got.most) EXPECT_GT(most, 100) << "every device had its share";
  }
}

/// Eight orders, or twenty: each turns a given pair of kernels round by even chance.
TEST(LiquidSplit, HasTheBitsOfOneDeviceInAnyOrder) {
  const std::uint64_t orders = std::getenv("TACTUS_LONG_TESTS") != nullptr ? 20 : 8;
  const Splash expected = splash("cpu", LiquidSolver::dfsph, 0, 12, 2);
  const Splash by_weakly = splash("cpu", LiquidSolver::wcsph, 0, 2, 2);
  for (std::uint64_t seed = 1; seed <= orders; ++seed) {
    const Splash got = splash("cpu:3", LiquidSolver::dfsph, seed, 12, 2);
    expect_same(got.states.back(), expected.states.back(), "seed " + std::to_string(seed));
    const Splash weakly = splash("cpu:3", LiquidSolver::wcsph, seed, 2, 2);
    expect_same(weakly.states.back(), by_weakly.states.back(), "wcsph, seed " + std::to_string(seed));
    if (HasFatalFailure()) return;
  }
}

/// A blast sends particles over whole slabs in one step, and cuts jump: nothing is lost.
TEST_P(LiquidSplits, LosesNothingThatFlies) {
  const auto blast = [](const std::string& devices) {
    DeviceSet set(devices, 3);
    LiquidSettings settings = trough(LiquidSolver::dfsph);
    settings.emitters.clear();
    settings.sinks_m.clear();
    Liquid liquid(set, settings);
    std::vector<LiquidParticle> particles = dam();
    for (LiquidParticle& p : particles) p.v_m_s = {p.id % 7 == 0 ? 400.F : 0.F, 0, 0};
    liquid.place(particles);
    for (int i = 0; i < 40; ++i) {
      liquid.step({.dt_s = 1e-3F, .gravity_m_s2 = kGravity});
      if (i % 5 != 4) continue;
      liquid.end_frame();
      liquid.balance(layers_of(set, liquid));
    }
    return state_of(set, liquid);
  };
  const State expected = blast("cpu"), got = blast(GetParam());
  EXPECT_EQ(expected.particles.size(), 600U);
  expect_same(got, expected, "");
}

/// What a run goes on from doesn't depend on the devices either.
TEST_P(LiquidSplits, GoesOnFromACheckpointOfOthers) {
  const auto steps = [](Liquid& liquid) {
    for (int i = 0; i < 40; ++i) liquid.step({.dt_s = liquid.largest_step_s(), .gravity_m_s2 = kGravity});
  };
  DeviceSet one("cpu"), set(GetParam(), 5);
  Liquid first(one, trough(LiquidSolver::dfsph)), second(set, trough(LiquidSolver::dfsph));
  for (Liquid* liquid : {&first, &second}) {
    liquid->place(dam());
    steps(*liquid);
  }
  StateArchive saved, other;
  first.archive(saved);
  second.archive(other);
  EXPECT_TRUE(saved.bytes() == other.bytes());
  StateArchive read(saved.bytes(), "saved");
  second.archive(read);
  steps(first);
  steps(second);
  state_of(one, first), state_of(set, second);  // what walls got before isn't in it
  steps(first);
  steps(second);
  expect_same(state_of(set, second), state_of(one, first), "after");
}

TEST(LiquidSplit, SmallLiquidsAreOnFewDevices) {
  LiquidSettings settings = trough(LiquidSolver::dfsph);
  DeviceSet three("cpu:3"), staged("cpu:3", 0, PeerAccess::staged);
  EXPECT_EQ(Liquid::part_count(three, settings), 3);
  EXPECT_EQ(Liquid::part_count(staged, settings), 1) << "devices can't read one another's memory";
  settings.least_particles = 300;
  EXPECT_EQ(Liquid::part_count(three, settings), 2) << "640 particles";
  settings.least_particles = 641;
  EXPECT_EQ(Liquid::part_count(three, settings), 1);
}

/// Equal layers of 100 along x, the longest axis; `filled` of them.
std::vector<Index> layers_along_x(Index filled) {
  std::vector<Index> counts(LiquidLayers::kCounts);
  for (Index k = 0; k < filled; ++k) counts[static_cast<std::size_t>(k)] = 100;
  counts[LiquidLayers::kLayers] = counts[2 * LiquidLayers::kLayers] = 100 * filled;
  return counts;
}
constexpr Box3f kUnitBox{{0, 0, 0}, {1, 1, 1}};

TEST(LiquidBalance, CutsEqualCounts) {
  LiquidBalance balance(kUnitBox, 4);
  balance.begin(layers_along_x(512));
  EXPECT_EQ(balance.slabs().axis, 0);
  for (int k = 1; k < 4; ++k) EXPECT_EQ(balance.slabs().begin_m[k], 0.125F * static_cast<float>(k));
}

TEST(LiquidBalance, MovesHalfwayWhenUneven) {
  LiquidBalance balance(kUnitBox, 2);
  balance.begin(layers_along_x(512));
  EXPECT_EQ(balance.slabs().begin_m[1], 0.25F);
  const std::vector<Index> counts = layers_along_x(1024);
  EXPECT_FALSE(balance.move(counts, std::vector<Index>{52000, 50400}, {})) << "1.6 % over the mean";
  EXPECT_TRUE(balance.move(counts, std::vector<Index>{25600, 76800}, {}));
  EXPECT_EQ(balance.slabs().begin_m[1], 0.375F);
}

/// A device that is half as fast gets half as much, once that was measured often enough.
TEST(LiquidBalance, FollowsMeasuredTime) {
  LiquidBalance balance(kUnitBox, 2);
  const std::vector<Index> counts = layers_along_x(1024);
  balance.begin(counts);
  for (int k = 0; k < 40; ++k) {
    const double cut = double{balance.slabs().begin_m[1]};
    const std::vector<Index> of_part{static_cast<Index>(102400 * cut),
                                     static_cast<Index>(102400 * (1 - cut))};
    balance.move(counts, of_part, std::vector<double>{of_part[0] * 2e-9, of_part[1] * 1e-9});
  }
  // Slower by 1.05 over the mean, the first has n = 0.356: 3 n = 1.05 (1.5 n + 0.75 (1 - n)).
  EXPECT_NEAR(balance.slabs().begin_m[1], 1.0 / 3, 0.023) << "within what counts as even";
  LiquidBalance unknown(kUnitBox, 2);
  unknown.begin(counts);
  EXPECT_FALSE(unknown.move(counts, std::vector<Index>{51200, 51200}, std::vector<double>{1, 0}))
      << "one wasn't measured: counts alone";
}

TEST(LiquidBalance, TurnsToTheLongestAxis) {
  LiquidBalance balance(kUnitBox, 2);
  balance.begin(layers_along_x(512));
  std::vector<Index> counts(LiquidLayers::kCounts);
  for (Index k = 0; k < 100; ++k) counts[static_cast<std::size_t>(k)] = 10;
  for (Index k = 0; k < 1000; ++k) counts[static_cast<std::size_t>(2 * LiquidLayers::kLayers + k)] = 1;
  counts[LiquidLayers::kLayers] = 1000;
  EXPECT_TRUE(balance.move(counts, std::vector<Index>{1000, 0}, {}));
  EXPECT_EQ(balance.slabs().axis, 2);
  EXPECT_NEAR(balance.slabs().begin_m[1], 500.0 / 1024, 1.5 / 1024);
}

}  // namespace
}  // namespace tactus
