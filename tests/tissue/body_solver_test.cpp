#include "tactus/tissue/hybrid/body_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "support/device_sets.h"
#include "tactus/multi_device/device_replay.h"

namespace tactus {
namespace {

constexpr ElasticMaterial kMaterial{.young_Pa = 30000, .poisson = 0.45F};

/// A ball with a hole through it, 49 layers high: rows of any length, layers of one and of many pieces.
CubeLattice bead() {
  const auto distance_m = [](Vec3f p) {
    const float hole = 0.03F - std::sqrt(p.x * p.x + p.z * p.z);
    return std::max(length(p) - 0.12F, hole);
  };
  CubeLattice lattice =
      lattice_from_sdf(distance_m, {{-0.13F, -0.13F, -0.13F}, {0.13F, 0.13F, 0.13F}}, {.spacing_m = 0.005F});
  lattice.fix_half_space({0, -0.1F, 0}, {0, 1, 0});
  return lattice;
}

/// What is spun, squeezed and dropped for so many substeps comes out so.
struct Motion {
  std::vector<Vec3f> x_m, v_m_s;
  friend bool operator==(const Motion&, const Motion&) = default;
};

std::vector<Vec3f> spin(const CubeLattice& lattice) {
  std::vector<Vec3f> v;
  for (const Vec3f p : lattice.rest_positions_m()) v.push_back({-4 * p.z, 0.3F * p.x, 4 * p.x - 2 * p.y});
  return v;
}

Motion on_slabs(DeviceSet& devices, const CubeLattice& lattice, const ElementMask& elements, int half_width,
                int substeps, int* slabs = nullptr, int matching_every = 1) {
  BodySolver body(devices,
                  {.lattice = lattice,
                   .elements = elements,
                   .materials = {&kMaterial, 1},
                   .flsm = {.young_Pa = 30000, .half_width = half_width}},
                  {.least_elements = 0});
  body.set_state(lattice.rest_positions_m(), spin(lattice));
  if (slabs != nullptr) *slabs = body.slab_count();
  // An odd number, twice: positions ahead begin in the same one of two buffers.
  DeviceReplay replay;
  for (int k = 0; k < 3; ++k)
    replay.run(devices, [&] {
      body.step({.dt_s = body.stable_step_s(), .matching_every = matching_every}, substeps);
    });
  return {body.positions_m(), body.velocities_m_s()};
}

Motion on_one_cpu(const CubeLattice& lattice, const ElementMask& elements, int half_width, int substeps,
                  int matching_every = 1) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  Hybrid body(ctx, {.lattice = lattice,
                    .elements = elements,
                    .materials = {&kMaterial, 1},
                    .flsm = {.young_Pa = 30000, .half_width = half_width}});
  BodyState state = rest_state(ctx, lattice);
  state.v_m_s = to_device(ctx, spin(lattice));
  for (int k = 0; k < 3; ++k)
    body.step(ctx, state, {.dt_s = body.stable_step_s(), .matching_every = matching_every}, substeps);
  return {to_host(ctx, state.x_m.const_view()), to_host(ctx, state.v_m_s.const_view())};
}

class BodySolverDevices : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(BodySolverDevices);

TEST_P(BodySolverDevices, ElementsMoveAsOnOneCpu) {
  const CubeLattice lattice = bead();
  DeviceSet devices(GetParam(), 5);
  int slabs = 0;
  EXPECT_TRUE(on_slabs(devices, lattice, {}, 1, 7, &slabs) == on_one_cpu(lattice, {}, 1, 7));
  EXPECT_EQ(slabs, devices.count());
}

TEST_P(BodySolverDevices, HalvesOfBothModelsMoveAsOnOneCpu) {
  const CubeLattice lattice = bead();
  DeviceSet devices(GetParam(), 6);
  for (const int axis : {0, 2}) {
    const ElementMask mask = split_by_ratio(lattice, axis, 6, 4);
    EXPECT_TRUE(on_slabs(devices, lattice, mask, 2, 5) == on_one_cpu(lattice, mask, 2, 5)) << "axis " << axis;
  }
}

TEST_P(BodySolverDevices, ShapesMatchedEveryOtherSubstepMoveAsOnOneCpu) {
  const CubeLattice lattice = bead();
  DeviceSet devices(GetParam(), 8);
  const ElementMask mask = split_by_ratio(lattice, 1, 6, 4);
  EXPECT_TRUE(on_slabs(devices, lattice, mask, 2, 6, nullptr, 2) == on_one_cpu(lattice, mask, 2, 6, 2));
}

TEST_P(BodySolverDevices, MatchedShapesOfAnyWidthMoveAsOnOneCpu) {
  const CubeLattice lattice = bead();
  DeviceSet devices(GetParam(), 7);
  const ElementMask none(lattice.cubes.size(), 0);
  static std::map<int, Motion> expected;  // the same for all devices
  for (int w = 1; w <= 4; ++w) {
    int slabs = 0;
    if (!expected.contains(w)) expected[w] = on_one_cpu(lattice, none, w, 3);
    EXPECT_TRUE(on_slabs(devices, lattice, none, w, 3, &slabs) == expected[w]) << "w " << w;
    EXPECT_EQ(slabs, std::min(devices.count(), 3)) << "w " << w;  // 49 layers, 16 at least
  }
}

/// Whatever order the queues run in that their events allow. Halves of the column have an interior that
/// depends on no other device, quarters have none.
TEST(BodySolver, AnyLegalOrderGivesTheSameBits) {
  const CubeLattice lattice = lattice_from_box({0, 0, 0}, {4, 4, 48}, {.spacing_m = 0.005F});
  const ElementMask mask = split_by_ratio(lattice, 1, 1, 1);
  const Motion elements = on_one_cpu(lattice, {}, 1, 4), both = on_one_cpu(lattice, mask, 1, 4);
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    DeviceSet devices(seed % 4 == 0 ? "cpu:4" : "cpu:2", seed);
    ASSERT_TRUE(on_slabs(devices, lattice, {}, 1, 4) == elements) << "seed " << seed;
    if (seed <= 20) {
      ASSERT_TRUE(on_slabs(devices, lattice, mask, 1, 4) == both) << "seed " << seed;
    }
  }
}

/// Devices that can't read each other's memory get copies.
TEST(BodySolver, CopiedNodesGiveTheSameBits) {
  const CubeLattice lattice = bead();
  const ElementMask mask = split_by_ratio(lattice, 1, 1, 1);
  DeviceSet devices("cpu:3", 3, PeerAccess::staged);
  EXPECT_TRUE(on_slabs(devices, lattice, {}, 1, 4) == on_one_cpu(lattice, {}, 1, 4));
  EXPECT_TRUE(on_slabs(devices, lattice, mask, 2, 4) == on_one_cpu(lattice, mask, 2, 4));
}

TEST(BodySolver, ThinBodiesAreOnFewerDevices) {
  DeviceSet devices("cpu:4");
  const CubeLattice lattice = lattice_from_box({0, 0, 0}, {6, 6, 4}, {.spacing_m = 0.01F});
  int slabs = 0;
  on_slabs(devices, lattice, {}, 1, 1, &slabs);
  EXPECT_EQ(slabs, 2);  // 5 layers of nodes, 2 at least
  on_slabs(devices, lattice, ElementMask(lattice.cubes.size(), 0), 1, 1, &slabs);
  EXPECT_EQ(slabs, 1);
}

TEST(BodySolver, SmallBodiesAreOnFewerDevices) {
  DeviceSet devices("cpu:4");
  const CubeLattice lattice = lattice_from_box({0, 0, 0}, {10, 10, 40}, {.spacing_m = 0.01F});
  const auto slabs = [&](const ElementMask& elements, double least) {
    return BodySolver(devices, {.lattice = lattice, .elements = elements, .materials = {&kMaterial, 1}},
                      {.least_elements = least})
        .slab_count();
  };
  const ElementMask none(lattice.cubes.size(), 0);
  EXPECT_EQ(slabs({}, 1000), 4);  // of 4,000 elements
  EXPECT_EQ(slabs({}, 1500), 2);
  EXPECT_EQ(slabs({}, 5000), 1);
  EXPECT_EQ(slabs(none, 15000), 1);
  EXPECT_EQ(slabs(none, 14000), 2);  // they cost seven times as much
}

TEST(SplitByCost, CutsWhereCostsAreEqual) {
  const auto ends = [](const std::vector<Slab>& slabs) {
    std::vector<Index> all;
    for (const Slab s : slabs) all.push_back(s.end);
    return all;
  };
  const std::vector<double> even(40, 1.0);
  EXPECT_EQ(ends(split_by_cost(even, 4, 1, 1)), (std::vector<Index>{10, 20, 30, 40}));
  EXPECT_EQ(ends(split_by_cost(even, 4, 8, 8)), (std::vector<Index>{8, 16, 32, 40}));
  std::vector<double> heavy(40, 1.0);
  std::fill_n(heavy.begin(), 10, 7.0);  // 100 in all
  EXPECT_EQ(ends(split_by_cost(heavy, 2, 1, 1)), (std::vector<Index>{7, 40}));
  EXPECT_EQ(ends(split_by_cost(heavy, 8, 8, 16)), (std::vector<Index>{16, 40}));
  EXPECT_EQ(ends(split_by_cost(even, 1, 8, 64)), (std::vector<Index>{40}));
}

}  // namespace
}  // namespace tactus
