/// Bodies on many devices that are moved and loaded.
#include <gtest/gtest.h>

#include <tuple>

#include "support/device_sets.h"
#include "tactus/multi_device/device_replay.h"
#include "tactus/tissue/hybrid/body_solver.h"

namespace tactus {
namespace {

constexpr ElasticMaterial kMaterial{.young_Pa = 30000, .poisson = 0.45F};
constexpr int kFrames = 3;

/// A column of 6 x 5 x 48 cubes along the axis that is cut. Over all its length, one side is fixed, one edge
/// is moved and turned, nodes of another side are moved and let go in the second frame, and every other cube
/// is pulled and pressed on a triangle.
struct Column {
  Column() : lattice(lattice_from_box({0, 0, 0}, {6, 5, 48}, {.spacing_m = 0.005F})) {
    lattice.fix_half_space({0.0299F, 0, 0}, {-1, 0, 0});
    NodeMotion edge, side;
    edge.name = "edge";
    edge.keys = {{0.003, {-0.002, 0.001, 0}, 0.3}, {0.1, {0, 0, 0.01}, 2}};
    edge.axis = {0, 0, 1};
    side.name = "side";
    side.keys = {{0.05, {0, 0.01, 0}, 0}};
    side.release_s = 0.003;
    for (Index i = lattice.node_count(); i-- > 0;) {  // any order will do
      const Vec3i n = lattice.nodes[static_cast<std::size_t>(i)];
      if (n.x == 0 && n.y < 2) edge.nodes.push_back(i);
      if (n.y == 5 && n.x > 1 && n.x < 4) side.nodes.push_back(i);
    }
    motions = {edge, side};
    surface.positions_m = lattice.rest_positions_m();
    SurfaceLoad pull, press;
    pull.name = "pull";
    pull.traction_Pa = {300, 100, -200};
    pull.keys = {{0, 0}, {0.004, 1}};
    press.name = "press";
    press.pressure_Pa = 500;
    for (std::size_t c = 0; c < lattice.cubes.size(); c += 2) {
      const auto& q = lattice.cube_nodes[c];
      (c % 4 == 0 ? pull : press).triangles.push_back(static_cast<Index>(surface.triangles.size()));
      surface.triangles.push_back({q[0], q[3], q[5]});
    }
    loads = {pull, press};
  }
  BoundaryConditions conditions() const { return {motions, loads, &surface}; }
  ElementMask mask(double elements, double matched) const {
    return split_by_ratio(lattice, 2, elements, matched);
  }

  CubeLattice lattice;
  std::vector<NodeMotion> motions;
  std::vector<SurfaceLoad> loads;
  TriangleMesh surface;
};

struct Case {
  ElementMask elements{};
  int half_width = 1, substeps = 6, matching_every = 1;
  BodyModel model(const Column& column) const {
    return {.lattice = column.lattice,
            .elements = elements,
            .materials = {&kMaterial, 1},
            .flsm = {.young_Pa = 30000, .half_width = half_width},
            .conditions = column.conditions()};
  }
};

/// What three frames come to.
struct Played {
  std::vector<Vec3f> x_m, v_m_s;
  std::vector<std::vector<Vec3d>> forces_N;  ///< per frame and motion
  friend bool operator==(const Played&, const Played&) = default;
};

Played on_slabs(DeviceSet& devices, const Column& column, const Case& c, BodySolver* body = nullptr) {
  std::optional<BodySolver> own;
  if (body == nullptr)
    body = &own.emplace(devices, c.model(column), BodySolver::Settings{.least_elements = 0});
  EXPECT_EQ(body->slab_count() > 1, devices.count() > 1);
  const BodyStep step{.dt_s = body->stable_step_s(), .matching_every = c.matching_every};
  DeviceReplay replay;
  Played played;
  for (int frame = 0; frame < kFrames; ++frame) {
    replay.run(devices, [&] {
      body->begin_frame();
      body->step(step, c.substeps);
      body->end_frame(c.substeps);
    });
    played.forces_N.push_back(body->motion_forces(double{step.dt_s} * c.substeps).forces_N);
  }
  played.x_m = to_host(devices.context(0), body->body().x_m.const_view());
  played.v_m_s = to_host(devices.context(0), body->body().v_m_s.const_view());
  EXPECT_EQ(played.x_m, body->positions_m());
  EXPECT_EQ(played.v_m_s, body->velocities_m_s());
  return played;
}

/// The whole body, step after step.
Played on_one_cpu(const Column& column, const Case& c) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  Hybrid body(ctx, c.model(column));
  Boundary boundary(ctx, column.lattice, column.conditions(), all_nodes(column.lattice));
  BodyState state = rest_state(ctx, column.lattice);
  const BodyStep step{.dt_s = body.stable_step_s(), .matching_every = c.matching_every};
  Played played;
  for (int frame = 0; frame < kFrames; ++frame) {
    boundary.begin_frame(ctx);
    for (int k = 0; k < c.substeps; ++k) {
      boundary.load(ctx, state, step.time());
      body.sum_forces(ctx, state, step, k);
      body.move(ctx, state, step, k);
      boundary.move(ctx, state, step.time());
    }
    auto& forces = played.forces_N.emplace_back(column.motions.size());
    boundary.driven().add_mean_forces_N(ctx, double{step.dt_s} * c.substeps, forces);
  }
  played.x_m = to_host(ctx, state.x_m.const_view());
  played.v_m_s = to_host(ctx, state.v_m_s.const_view());
  return played;
}

std::vector<Case> all_cases(const Column& column) {
  return {{},
          {.elements = column.mask(1, 1), .half_width = 2},
          {.elements = column.mask(1, 1), .half_width = 2, .matching_every = 3},
          {.elements = column.mask(0, 1), .half_width = 1}};
}

class SlabBoundary : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(SlabBoundary);

TEST_P(SlabBoundary, MovedAndLoadedBodiesAreThoseOfOneCpu) {
  const Column column;
  for (const Case& c : all_cases(column)) {
    DeviceSet devices(GetParam(), 11);
    const Played expected = on_one_cpu(column, c);
    EXPECT_TRUE(on_slabs(devices, column, c) == expected) << "every " << c.matching_every;
    for (const std::vector<Vec3d>& frame : expected.forces_N) EXPECT_GT(length(frame[0]), 0.01);
    EXPECT_GT(length(expected.forces_N[0][1]), 0.01);
  }
}

/// Strain and the check of nodes are of the whole body, whoever looked.
TEST_P(SlabBoundary, WhatIsNotedIsWhatOneCpuNotes) {
  const Column column;
  for (const Case& c : all_cases(column)) {
    const auto noted = [&](const std::string& text) {
      DeviceSet devices(text, 12);
      BodySolver body(devices, c.model(column), {.least_elements = 0});
      on_slabs(devices, column, c, &body);
      return std::pair{body.extremes(), body.node_check()};
    };
    const auto [strain, check] = noted(GetParam());
    const auto [expected_strain, expected_check] = noted("cpu");
    EXPECT_EQ(strain.speed_ratio, expected_strain.speed_ratio);
    EXPECT_EQ(strain.fastest_cube, expected_strain.fastest_cube);
    EXPECT_EQ(strain.smallest_J, expected_strain.smallest_J);
    EXPECT_EQ(strain.smallest_cube, expected_strain.smallest_cube);
    EXPECT_EQ(strain.inverted, expected_strain.inverted);
    EXPECT_EQ(check.fastest2_m2_s2, expected_check.fastest2_m2_s2);
    EXPECT_EQ(check.fastest_node, expected_check.fastest_node);
    EXPECT_EQ(check.bad_substep, -1);
    EXPECT_GT(check.fastest2_m2_s2, 0.01F);
  }
}

/// Two nodes go twice as far as is taken for numbers, at the far end or near the middle: they are named, and
/// the substep, wherever they were.
TEST_P(SlabBoundary, WhatIsTornAwayIsNamed) {
  Column column;
  column.motions.resize(1);
  column.motions[0].keys = {{1e-3, {2e5, 0, 0}, 0}};
  for (const Index node : {2002, 903}) {
    column.motions[0].nodes = {node, node + 1};
    DeviceSet devices(GetParam(), 13);
    BodySolver body(devices,
                    {.lattice = column.lattice,
                     .elements = column.mask(0, 1),
                     .materials = {&kMaterial, 1},
                     .conditions = column.conditions()},
                    {.least_elements = 0});
    body.begin_frame();
    body.step({.dt_s = 1e-3F}, 3);
    body.end_frame(3);
    const NodeCheckRecord check = body.node_check();
    EXPECT_EQ(check.bad_substep, 0);
    EXPECT_EQ(check.bad_node, node);
  }
}

/// In whatever order the queues run that their events allow, and from copies.
TEST(SlabBoundary, AnyLegalOrderGivesTheSameBits) {
  const Column column;
  for (const Case& c : all_cases(column)) {
    const Played expected = on_one_cpu(column, c);
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      DeviceSet devices(seed % 2 == 0 ? "cpu:4" : "cpu:2", seed,
                        seed % 4 < 2 ? PeerAccess::automatic : PeerAccess::staged);
      ASSERT_TRUE(on_slabs(devices, column, c) == expected) << "seed " << seed;
    }
  }
}

/// Nothing waits for the host between frames, nor between what a frame notes and the next.
TEST(SlabBoundary, FramesFollowOneAnother) {
  const Column column;
  for (const bool is_free : {true, false}) {
    const auto played = [&](const std::string& text, std::uint64_t seed) {
      DeviceSet devices(text, seed);
      BodySolver body(devices,
                      {.lattice = column.lattice,
                       .materials = {&kMaterial, 1},
                       .conditions = is_free ? BoundaryConditions{} : column.conditions()},
                      {.least_elements = 0});
      for (int frame = 0; frame < kFrames; ++frame) {
        body.begin_frame();
        body.step({.dt_s = body.stable_step_s()}, 5);
        body.end_frame(5);
      }
      const tled::CubeExtremes strain = body.extremes();
      const NodeCheckRecord check = body.node_check();
      return std::tuple{to_host(devices.context(0), body.body().x_m.const_view()),
                        to_host(devices.context(0), body.body().v_m_s.const_view()),
                        strain.speed_ratio,
                        strain.smallest_J,
                        check.fastest2_m2_s2,
                        check.fastest_node};
    };
    const auto expected = played("cpu", 0);
    EXPECT_GT(std::get<2>(expected), 1.F);
    for (std::uint64_t seed = 1; seed <= 300; ++seed)
      ASSERT_TRUE(played(seed % 2 == 0 ? "cpu:4" : "cpu:2", seed) == expected) << "seed " << seed;
  }
}

}  // namespace
}  // namespace tactus
