// Bodies that are cut between frames.
#include "tactus/tissue/topology_change.h"

#include <gtest/gtest.h>

#include <map>

#include "support/device_sets.h"
#include "tactus/frame/schedule.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/multi_device/device_replay.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tled_bodies.h"

namespace tactus {
namespace {

constexpr ElasticMaterial kMaterial{.young_Pa = 3000, .poisson = 0.4F};
constexpr VirtualCapacity kCapacity{.copies = 500, .nodes = 700};

CubeLattice uncut(const CubeLattice& whole) {
  return cut_lattice(
      whole, [](Vec3i, int) { return false; }, kCapacity);
}

/// Along and across the slabs' layers, where y is low.
CubeLattice cross_cut(const CubeLattice& whole) {
  const Index mid = whole.node_dims.z / 2;
  return cut_lattice(
      whole,
      [=](Vec3i p, int axis) {
        return p.y <= 2 &&
               ((axis == 0 && p.x == 2) || (axis == 2 && p.x >= 2 && (p.z == mid || p.z == mid - 6)));
      },
      kCapacity);
}

/// A body that a schedule runs, as a scene's bodies.
struct ScheduledBody {
  ScheduledBody(DeviceSet& devices, const CubeLattice& lattice, const ElementMask& elements,
                const TledOptions& options)
      : body(devices,
             {.lattice = lattice,
              .elements = elements,
              .materials = {&kMaterial, 1},
              .tled = options,
              .flsm = {.young_Pa = 3000, .half_width = 1}},
             {.least_elements = 0}),
        schedule(devices) {
    body.follow(schedule.frame());
    const auto add = [&](const char* name, Rate rate, std::function<void(BlockPlace)> submit) {
      schedule.add({.name = name,
                    .timed_as = name,
                    .rate = rate,
                    .devices = StageDevices::all,
                    .updates = {"nodes"},
                    .submit = std::move(submit)});
    };
    add("begin", Rate::before, [this](BlockPlace) {
      body.begin_frame();
      body.begin_substeps();
    });
    add("step", Rate::substep, [this](BlockPlace at) { body.substep({}, at.substep, at.count); });
    add("end", Rate::after, [this](BlockPlace) {
      body.end_substeps(0);
      body.end_frame(0);
    });
    schedule.close();
  }
  void run(int frames) {
    Timings timings;
    for (int k = 0; k < frames; ++k) {
      schedule.run({.dt_s = body.stable_step_s(), .gravity_m_s2 = {0, -9.81F, 0}, .substeps = 5 + k % 3},
                   true);
      schedule.finish(timings);
    }
  }
  BodySolver body;
  Schedule schedule;
};

std::vector<Vec3f> wild(const CubeLattice& lattice) {
  std::vector<Vec3f> v;
  for (const Vec3f p : lattice.rest_positions_m()) v.push_back({-9 * p.z + 0.2F, 6 * p.x, 9 * p.x - 2 * p.y});
  return v;
}

class ChangeDevices : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(ChangeDevices);

/// Cut in flight, and put together with that cut: the same bits from then on, and nothing is recorded anew.
TEST_P(ChangeDevices, ACutBodyMovesAsOneThatWasBuiltCut) {
  DeviceSet devices(GetParam(), 11);
  const CubeLattice whole = lattice_from_box({}, {4, 4, 48}, {.spacing_m = kH});
  const CubeLattice before = uncut(whole), after = cross_cut(whole);
  for (const ElementMask& elements : {ElementMask{}, with_copies(before, split_by_ratio(whole, 1, 2, 1))}) {
    ElementMask built_elements =
        elements.empty() ? elements : with_copies(after, split_by_ratio(whole, 1, 2, 1));
    // Capacity is made of elements: only those can be cut.
    ElementMask cut_elements = elements;
    for (std::size_t c = whole.cubes.size(); c < cut_elements.size(); ++c) cut_elements[c] = 1;
    ScheduledBody cut(devices, before, cut_elements, {}), built(devices, after, built_elements, {});
    cut.body.set_state(before.rest_positions_m(), wild(before));
    // Shape matching goes on from the rotations of the last substep, so there nothing may have moved yet.
    if (elements.empty()) cut.run(4);
    cut.body.apply(topology_change(before, after));
    built.body.set_state(cut.body.positions_m(), cut.body.velocities_m_s());
    cut.run(5);
    built.run(5);
    EXPECT_TRUE(cut.body.positions_m() == built.body.positions_m());
    EXPECT_TRUE(cut.body.velocities_m_s() == built.body.velocities_m_s());
    EXPECT_EQ(cut.schedule.recordings(), 1);
    const RigidMotion a = cut.body.rigid_motion(), b = built.body.rigid_motion();
    EXPECT_NEAR(a.mass_kg, whole.mass_kg(), 1e-5 * a.mass_kg);
    EXPECT_EQ(a.mass_kg, b.mass_kg);
    EXPECT_EQ(a.kinetic_J, b.kinetic_J);
  }
}

/// A body that was stretched long enough for its stress to fade is cut. At that moment each new node is where
/// its twin is, and copies share the history of their cube. So the forces on a node and on those that were
/// split from it add up to the force before: 24 bits of sums of eight or more.
TEST(TopologyChange, CopiesTakeOverWhatHasRelaxed) {
  const CubeLattice whole = box({5, 4, 3}), before = uncut(whole),
                    after = cut_lattice(
                        whole, [](Vec3i p, int axis) { return axis == 0 && p.x == 2 && p.y >= 1; },
                        kCapacity);
  DeviceSet devices("cpu");
  TledOptions relaxing{.damping_ratio = 0};
  relaxing.relaxation[0] = {.share = 0.5F, .time_s = 0.002F};
  const auto momenta = [&](bool is_cut, bool takes_over) {
    BodySolver body(
        devices,
        {.lattice = is_cut && !takes_over ? after : before, .materials = {&kMaterial, 1}, .tled = relaxing},
        {.least_elements = 0});
    std::vector<Vec3f> x = before.rest_positions_m();
    for (Vec3f& p : x) p = {1.2F * p.x, p.y, p.z};
    const std::vector<Vec3f> still(x.size());
    const auto step = [&] { body.step({.dt_s = body.stable_step_s(), .gravity_m_s2 = {}}); };
    for (int k = 0; k < (takes_over || !is_cut ? 20 : 0); ++k) {
      body.set_state(x, still);
      step();
    }
    if (is_cut && takes_over) body.apply(topology_change(before, after));
    if (is_cut)
      for (std::size_t k = 0; k < after.virtual_nodes.size(); ++k)
        if (after.virtual_nodes[k] >= 0) x[at(after.regular_nodes()) + k] = x[at(after.virtual_nodes[k])];
    body.set_state(x, still);
    step();
    const std::vector<Vec3f> v = body.velocities_m_s();
    const CubeLattice& lattice = is_cut ? after : before;
    std::vector<Vec3f> sum(whole.nodes.size());
    for (Index i = 0; i < lattice.node_count(); ++i) {
      const Index k = i - lattice.regular_nodes(), twin = k < 0 ? i : lattice.virtual_nodes[at(k)];
      if (twin >= 0) sum[at(twin)] += lattice.node_mass_kg[at(i)] * v[at(i)];
    }
    return sum;
  };
  const auto differs = [](const std::vector<Vec3f>& a, const std::vector<Vec3f>& b) {
    float most = 0, size = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      most = max(most, length(a[i] - b[i])), size = max(size, length(b[i]));
    return most / size;
  };
  const std::vector<Vec3f> whole_body = momenta(false, false);
  EXPECT_LT(differs(momenta(true, true), whole_body), 1e-5F);
  EXPECT_GT(differs(momenta(true, false), whole_body), 0.05F);  // without a history it pulls harder
}

TEST(TopologyChange, LatticesFollow) {
  const CubeLattice whole = box({5, 4, 3}), before = uncut(whole),
                    after = cut_lattice(
                        whole, [](Vec3i p, int axis) { return axis == 0 && p.x == 2 && p.y >= 1; },
                        kCapacity);
  CubeLattice lattice = before;
  apply(topology_change(before, after), lattice);
  EXPECT_EQ(lattice.cube_nodes, after.cube_nodes);
  EXPECT_EQ(lattice.cube_fill, after.cube_fill);
  EXPECT_EQ(lattice.cube_mass_kg, after.cube_mass_kg);
  EXPECT_EQ(lattice.node_mass_kg, after.node_mass_kg);
  EXPECT_EQ(lattice.virtual_nodes, after.virtual_nodes);
  EXPECT_EQ(lattice.fixed, after.fixed);
  EXPECT_TRUE(lattice.nodes == after.nodes);
  const TopologyChange none = topology_change(after, lattice);
  EXPECT_TRUE(none.cut.empty() && none.copies.empty() && none.nodes.empty());
}

/// Corners in spacings, faces as quads with outward normals.
TriangleMesh quads(const std::vector<Vec3f>& corners, const std::vector<std::array<Index, 4>>& faces) {
  TriangleMesh mesh;
  for (const Vec3f p : corners) mesh.positions_m.push_back(kH * p);
  for (const auto& [a, b, c, d] : faces) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  }
  return mesh;
}

/// The surface of a block, and of its halves: the same eight corners, and the walls of the cut.
std::vector<Vec3f> corners_and_walls() {
  std::vector<Vec3f> p;
  for (const float x : {0.F, 5.F, 2.5F, 2.5F})
    for (const Vec3f yz : {Vec3f{0, 0, 0}, Vec3f{0, 4, 0}, Vec3f{0, 4, 3}, Vec3f{0, 0, 3}})
      p.push_back(yz + Vec3f{x, 0, 0});
  return p;
}
/// Between a ring of four vertices at low x and one at high x.
void add_box(std::vector<std::array<Index, 4>>& faces, Index low, Index high) {
  faces.push_back({low, low + 3, low + 2, low + 1});
  faces.push_back({high, high + 1, high + 2, high + 3});
  for (Index k = 0; k < 4; ++k) {
    const Index next = (k + 1) % 4;
    faces.push_back({low + k, low + next, high + next, high + k});
  }
}

TEST_P(ChangeDevices, ASurfaceThatIsCutMovesAsOneThatWasBuiltCut) {
  DeviceSet devices(GetParam(), 12);
  ExecContext& ctx = devices.context(0);
  const CubeLattice whole = box({5, 4, 3}), before = uncut(whole),
                    after = cut_lattice(
                        whole, [](Vec3i p, int axis) { return axis == 0 && p.x == 2; }, kCapacity);
  std::vector<std::array<Index, 4>> one_box, two_boxes;
  add_box(one_box, 0, 4);
  add_box(two_boxes, 0, 8);
  add_box(two_boxes, 12, 4);
  std::vector<Vec3f> corners = corners_and_walls();
  const TriangleMesh cut_mesh = quads(corners, two_boxes);
  corners.resize(8);
  const TriangleMesh mesh = quads(corners, one_box);
  TopologyChange change = topology_change(before, after);
  const std::vector<embed::Anchor> anchors = anchor_vertices(after, cut_mesh);
  for (std::size_t v = 0; v < anchors.size(); ++v)
    change.vertices.push_back({static_cast<Index>(v), anchors[v].cube, anchors[v].local});
  for (std::size_t t = 0; t < cut_mesh.triangles.size(); ++t)
    change.triangles.push_back({static_cast<Index>(t), cut_mesh.triangles[t]});
  const SurfaceCapacity capacity{.vertices = 30, .triangles = 40};
  EmbeddedSurface surface(ctx, before, mesh, 1, capacity), built(ctx, after, cut_mesh, 1, capacity);
  BodyState state = rest_state(ctx, after);
  std::vector<Vec3f> x = after.rest_positions_m();
  for (Index i = 0; i < after.node_count(); ++i) {
    const bool is_virtual = i >= after.regular_nodes();
    x[at(i)] += Vec3f{(after.nodes[at(i)].x <= 2) != is_virtual ? -0.01F : 0.01F, 0.3F * x[at(i)].x, 0};
  }
  state.x_m = to_device(ctx, x);
  DeviceReplay replay;  // recorded before the cut
  for (int k = 0; k < 3; ++k) replay.run(devices, [&] { surface.update(ctx, state); });
  EXPECT_EQ(surface.to_mesh(ctx).positions_m.size(), 8U);
  surface.apply(ctx, change);
  replay.run(devices, [&] { surface.update(ctx, state); });
  built.update(ctx, state);
  const TriangleMesh a = surface.to_mesh(ctx), b = built.to_mesh(ctx);
  EXPECT_TRUE(a.positions_m == b.positions_m);
  EXPECT_TRUE(a.normals == b.normals);
  EXPECT_EQ(a.triangles, b.triangles);
  // The walls are apart by twice the shift.
  EXPECT_NEAR(a.positions_m[12].x - a.positions_m[8].x, 0.02F, 1e-7F);
  change.vertices.front().vertex = 30;
  EXPECT_THROW(surface.apply(ctx, change), Error);
}

TEST(TopologyChange, RefusesWhatItCannotHold) {
  const CubeLattice whole = box({5, 4, 3}), before = uncut(whole),
                    after = cut_lattice(
                        whole, [](Vec3i p, int axis) { return axis == 0 && p.x == 2; }, kCapacity);
  DeviceSet devices("cpu");
  BodySolver without_capacity(devices, {.lattice = whole, .materials = {&kMaterial, 1}},
                              {.least_elements = 0});
  EXPECT_THROW(without_capacity.apply(topology_change(before, after)), Error);
  ElementMask matched(before.cubes.size(), 1);
  std::fill_n(matched.begin(), 30, 0);
  BodySolver body(
      devices,
      {.lattice = before, .elements = matched, .materials = {&kMaterial, 1}, .flsm = {.half_width = 1}},
      {.least_elements = 0});
  EXPECT_THROW(body.apply(topology_change(before, after)), Error);
  EXPECT_THROW(topology_change(whole, after), Error);
}

}  // namespace
}  // namespace tactus
