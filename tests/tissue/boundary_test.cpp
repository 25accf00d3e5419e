/// Prescribed nodes and loads on the surface, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/base/error.h"
#include "tactus/tissue/boundary/driven_nodes.h"
#include "tactus/tissue/boundary/surface_loads.h"
#include "tactus/tissue/hybrid/hybrid.h"

namespace tactus {
namespace {

constexpr float kH = 0.005F, kYoung_Pa = 30000;
constexpr double kArea_m2 = 0.02 * 0.02;

/// 0.1 x 0.02 x 0.02 m along x, nu = 0: stretched along x, it stays as thick as it is.
struct Bar {
  explicit Bar(const std::string& devices = "cpu", double elements = 1, double matched = 0)
      : set(devices), lattice(lattice_from_box({0, 0, 0}, {20, 4, 4}, {.spacing_m = kH})) {
    const ElasticMaterial material{.young_Pa = kYoung_Pa, .poisson = 0};
    lattice.fix_half_space({1e-4F, 0, 0}, {1, 0, 0});
    model.emplace(ctx(), BodyModel{.lattice = lattice,
                                   .elements = split_by_ratio(lattice, 0, elements, matched),
                                   .materials = {&material, 1},
                                   .tled = {.damping_ratio = 0.1F},
                                   .flsm = {.young_Pa = kYoung_Pa, .half_width = 1, .damping_ratio = 0.1F}});
    state = rest_state(ctx(), lattice);
    held = to_device(ctx(), std::vector<Index>(lattice.nodes.size()));
  }
  ExecContext& ctx() { return set.context(0); }
  std::vector<Index> layer(Index x) const {
    std::vector<Index> nodes;
    for (Index i = 0; i < lattice.node_count(); ++i)
      if (lattice.nodes[static_cast<std::size_t>(i)].x == x) nodes.push_back(i);
    return nodes;
  }
  /// Steps of `dt_s` without gravity, with drag.
  void run(DrivenNodes& driven, int steps, float dt_s, float drag_per_s = 0) {
    for (int k = 0; k < steps; ++k) {
      model->step(ctx(), state, {.dt_s = dt_s, .gravity_m_s2 = {}, .drag_per_s = drag_per_s});
      driven.move(ctx(), state, held.view(), {.dt_s = dt_s, .gravity_m_s2 = {}});
    }
  }
  std::vector<Vec3f> x_m() { return to_host(ctx(), state.x_m.const_view()); }
  std::vector<Vec3f> v_m_s() { return to_host(ctx(), state.v_m_s.const_view()); }

  DeviceSet set;
  CubeLattice lattice;
  std::optional<Hybrid> model;
  BodyState state;
  Buffer<Index> held;
};

NodeMotion pull(const Bar& bar, double displacement_m, double time_s) {
  NodeMotion motion;
  motion.name = "grip";
  motion.keys = {{time_s, {displacement_m, 0, 0}, 0}};
  motion.nodes = bar.layer(20);
  return motion;
}

/// Of the one motion.
Vec3d force_N(Bar& bar, const DrivenNodes& driven, double dt_frame_s) {
  Vec3d force;
  driven.add_mean_forces_N(bar.ctx(), dt_frame_s, std::span(&force, 1));
  return force;
}

/// Force that holds the end of a bar of this ratio at a stretch of 1.05, and, of the fixed end, nothing else.
double force_at_stretch_N(double elements, double matched) {
  Bar bar("cpu", elements, matched);
  const NodeMotion motion = pull(bar, 0.005, 0.05);
  DrivenNodes driven(bar.ctx(), bar.lattice, std::span(&motion, 1), all_nodes(bar.lattice));
  const float dt_s = bar.model->stable_step_s();
  // Waves cross in 0.1 m / sqrt(E/rho) = 18 ms; drag of 50/s leaves exp(-25) of the motion after a second.
  bar.run(driven, static_cast<int>(1 / dt_s), dt_s, 50);
  driven.begin_frame(bar.ctx());
  bar.run(driven, 100, dt_s);  // drag would take its part of the forces
  const Vec3d force = force_N(bar, driven, 100 * double{dt_s});
  EXPECT_NEAR(force.y, 0, 1e-4);
  EXPECT_NEAR(force.z, 0, 1e-4);
  return force.x;
}

/// Neo-Hookean without lambda: P = mu (s - 1/s), mu = E/2, the same in every cube. Rounding of positions of
/// 0.1 m, 4e-9 m, over the 2.5e-4 m that a cube is stretched by: 2e-5, and of viscous forces that drag leaves
/// nothing of; 2e-4 is ten times that.
TEST(Driven, AStretchedBarOfElementsPullsBackAsTheClosedForm) {
  const double s = 1.05, expected = kArea_m2 * double{kYoung_Pa} / 2 * (s - 1 / s);
  EXPECT_NEAR(force_at_stretch_N(1, 0) / expected, 1, 2e-4);
}

/// Shape matching's stiffness is a calibration: E within 15 %; half of each lies between.
TEST(Driven, SoDoShapeMatchingAndBoth) {
  const double linear = kArea_m2 * double{kYoung_Pa} * 0.05;
  EXPECT_NEAR(force_at_stretch_N(0, 1) / linear, 1, 0.15);
  EXPECT_NEAR(force_at_stretch_N(1, 1) / linear, 1, 0.15);
}

class DrivenOnDevices : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(DrivenOnDevices);

/// Nodes are where the formula says, each substep, and their velocity is what brought them there.
TEST_P(DrivenOnDevices, NodesFollowTheFormulaAndEveryDeviceAgrees) {
  const auto play = [](Bar& bar, int steps, float dt_s) {
    NodeMotion motion = pull(bar, 0, 0);
    motion.keys = {{0, {}, 0}, {0.02, {0.01, 0, 0.002}, 1.0}, {0.03, {0.01, 0, 0}, 8.0}};
    motion.axis = {2, 0, 0};
    motion.pivot_m = {0, 0.01, 0.01};
    DrivenNodes driven(bar.ctx(), bar.lattice, std::span(&motion, 1), all_nodes(bar.lattice));
    bar.run(driven, steps, dt_s);
    bar.ctx().synchronize();
    return motion;
  };
  const float dt_s = 1e-4F;
  Bar bar(GetParam(), 6, 4), reference("cpu", 6, 4);
  const NodeMotion motion = play(bar, 251, dt_s);
  play(reference, 251, dt_s);
  EXPECT_EQ(bar.x_m(), reference.x_m());
  EXPECT_EQ(bar.v_m_s(), reference.v_m_s());
  // At 25.1 ms, 0.51 of the way from the second keyframe to the third.
  const auto angle_at = [](double t) { return 1 + 7 * (t - 0.02) / 0.01; };
  const auto place = [&](Vec3d rest, double t) {
    const double c = std::cos(angle_at(t)), s = std::sin(angle_at(t)), y = rest.y - 0.01, z = rest.z - 0.01;
    return Vec3d{rest.x + 0.01, 0.01 + c * y - s * z, 0.01 + s * y + c * z + 0.002 * (0.03 - t) / 0.01};
  };
  const std::vector<Vec3f> x = bar.x_m(), v = bar.v_m_s();
  const double end_s = 251 * double{dt_s}, begin_s = end_s - double{dt_s};
  for (const Index node : motion.nodes) {
    const auto i = static_cast<std::size_t>(node);
    const Vec3d rest = vec_cast<double>(bar.lattice.rest_m(node));
    // Float: positions of 0.1 m to 8e-9, angles to 5e-7 rad of an arm of 0.014 m.
    EXPECT_LT(length(vec_cast<double>(x[i]) - place(rest, end_s)), 3e-8);
    // Up to 700 rad/s * 0.014 m = 9.8 m/s, to 1e-6 of it.
    const Vec3d mean = (1 / double{dt_s}) * (place(rest, end_s) - place(rest, begin_s));
    EXPECT_LT(length(vec_cast<double>(v[i]) - mean), 1e-5);
  }
}

/// All nodes of a free bar driven at 0.5 m/s and then let go: it flies on, and nobody pulls it any more.
TEST(Driven, WhatIsReleasedFliesOn) {
  Bar bar;
  bar.lattice.fixed.assign(bar.lattice.fixed.size(), 0);
  const ElasticMaterial material{.young_Pa = kYoung_Pa, .poisson = 0};
  bar.model.emplace(bar.ctx(), BodyModel{.lattice = bar.lattice, .materials = {&material, 1}});
  NodeMotion motion = pull(bar, 0, 0);
  motion.keys = {{1, {0.5, 0, 0}, 0}};
  motion.release_s = 0.01;
  motion.nodes.clear();
  for (Index i = 0; i < bar.lattice.node_count(); ++i) motion.nodes.push_back(i);
  DrivenNodes driven(bar.ctx(), bar.lattice, std::span(&motion, 1), all_nodes(bar.lattice));
  const float dt_s = 1e-4F;
  bar.run(driven, 100, dt_s);
  EXPECT_EQ(to_host(bar.ctx(), bar.held.const_view()).front(), kAllAxes);
  const double mass = bar.lattice.mass_kg();
  // What brought it to speed: its momentum.
  EXPECT_NEAR(force_N(bar, driven, 0.01).x * 0.01 / (0.5 * mass), 1, 1e-5);
  driven.begin_frame(bar.ctx());
  bar.run(driven, 100, dt_s);
  EXPECT_EQ(to_host(bar.ctx(), bar.held.const_view()).front(), 0);
  EXPECT_EQ(force_N(bar, driven, 0.01), Vec3d{});
  const std::vector<Vec3f> x = bar.x_m();
  // 0.5 m/s for 20 ms, a rounding of x (up to 0.11 m: 4e-9) a substep.
  for (std::size_t i = 0; i < x.size(); ++i)
    EXPECT_NEAR(x[i].x - bar.lattice.rest_m(static_cast<Index>(i)).x, 0.01, 100 * 4e-9 + 1e-8);
}

/// A patch that is pulled out and released comes back to rest.
TEST(Driven, AReleasedPatchComesBack) {
  Bar bar;
  NodeMotion motion = pull(bar, 0.01, 0.02);
  motion.release_s = 0.03;
  DrivenNodes driven(bar.ctx(), bar.lattice, std::span(&motion, 1), all_nodes(bar.lattice));
  const float dt_s = bar.model->stable_step_s();
  bar.run(driven, static_cast<int>(0.028F / dt_s), dt_s, 50);
  const auto end = static_cast<std::size_t>(motion.nodes.front());
  EXPECT_NEAR(bar.x_m()[end].x, 0.11, 1e-8);
  bar.run(driven, static_cast<int>(1 / dt_s), dt_s, 50);
  EXPECT_NEAR(bar.x_m()[end].x, 0.1, 1e-6);  // exp(-25) of the 0.01 m, and rounding of 20 cubes' lengths
}

/// The message of the error that a motion causes.
std::string error_of(NodeMotion motion) {
  Bar bar;
  if (motion.nodes == std::vector<Index>{-1}) motion.nodes = bar.layer(20);
  return test::message_of(
      [&] { DrivenNodes(bar.ctx(), bar.lattice, std::span(&motion, 1), all_nodes(bar.lattice)); },
      ErrorKind::usage);
}

TEST(Driven, ErrorsNameMotionAndKey) {
  NodeMotion good;
  good.name = "grip";
  good.keys = {{0.5, {0.01, 0, 0}, 0}, {1, {0.02, 0, 0}, 0}};
  good.nodes = {-1};
  EXPECT_EQ(error_of(good), "");
  NodeMotion m = good;
  m.nodes.clear();
  EXPECT_EQ(error_of(m), "grip: it moves no node: its region holds none");
  m = good;
  m.keys.clear();
  EXPECT_EQ(error_of(m), "grip: it has no keyframe, expected at least one");
  m = good;
  m.keys[1].time_s = 0.5;
  EXPECT_EQ(error_of(m), "grip: keyframe 1 is at 0.5 s, expected later than the one before, at 0.5 s");
  m = good;
  m.keys[1].displacement_m.y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of(m), "grip: keyframe 1 holds a value that is not a number");
  m = good;
  m.keys[0].time_s = 0;
  EXPECT_EQ(
      error_of(m),
      "grip: keyframe 0 moves its nodes at 0 s, all at once; expected a later time, or no displacement");
  m = good;
  m.axis = {};
  EXPECT_EQ(error_of(m), "grip: its axis is zero, expected a direction");
  m = good;
  m.release_s = 0;
  EXPECT_EQ(error_of(m), "grip: it is released at 0 s, expected a time after 0");
  m = good;
  m.nodes = {0};
  EXPECT_EQ(error_of(m), "grip: node 0 of its region is also 'fixed'; expected one of both");
  m = good;
  m.nodes = {20, 20};
  EXPECT_EQ(error_of(m), "grip: node 20 of its region is also in grip; expected regions apart");
}

TEST(Driven, TheFastestMoveIsFound) {
  const Bar bar;
  NodeMotion motion = pull(bar, 0.01, 0.1);
  motion.keys.push_back({0.2, {0.01, 0, 0}, 3.0});
  motion.axis = {1, 0, 0};
  motion.pivot_m = {0, 0.01, 0.01};
  const FastestMove fastest = fastest_move(bar.lattice, motion);
  EXPECT_EQ(fastest.key, 1U);
  EXPECT_NEAR(fastest.speed_m_s, 30 * 0.01 * std::sqrt(2.0), 1e-6);  // corners of the bar's end
}

/// The boundary of a lattice, two triangles a face.
TriangleMesh boundary_of(const CubeLattice& lattice) {
  TriangleMesh mesh;
  mesh.positions_m = lattice.rest_positions_m();
  std::set<std::array<Index, 3>> cubes;
  for (const Vec3i c : lattice.cubes) cubes.insert({c.x, c.y, c.z});
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {0, 1}) {
        Vec3i next = lattice.cubes[c];
        next[axis] += side == 1 ? 1 : -1;
        if (cubes.contains({next.x, next.y, next.z})) continue;
        const auto corner = [&](unsigned u, unsigned v) {
          const auto a = static_cast<unsigned>(axis);
          const unsigned q = static_cast<unsigned>(side) << a | u << (a + 1) % 3 | v << (a + 2) % 3;
          return lattice.cube_nodes[c][q];
        };
        Index a = corner(0, 0), b = corner(1, 0), d = corner(1, 1), e = corner(0, 1);
        if (side == 0) std::swap(b, e);
        mesh.triangles.push_back({a, b, d});
        mesh.triangles.push_back({a, d, e});
      }
    }
  }
  return mesh;
}

/// Forces on all nodes of a bar for positions F x.
std::vector<Vec3f> forces_N(Bar& bar, const SurfaceLoad& load, const Mat3f& F, int steps = 1) {
  const TriangleMesh mesh = boundary_of(bar.lattice);
  SurfaceLoads loads(bar.ctx(), bar.lattice, mesh, std::span(&load, 1), all_nodes(bar.lattice));
  std::vector<Vec3f> x = bar.lattice.rest_positions_m();
  for (Vec3f& p : x) p = F * p;
  bar.state.x_m = to_device(bar.ctx(), x);
  for (int k = 0; k < steps; ++k) loads.apply(bar.ctx(), bar.state, {.dt_s = 0.1F, .gravity_m_s2 = {}});
  return to_host(bar.ctx(), bar.state.f_ext_N.const_view());
}

Vec3d sum(const std::vector<Vec3f>& forces) {
  Vec3d all;
  for (const Vec3f f : forces) all += vec_cast<double>(f);
  return all;
}

SurfaceLoad load_on(const TriangleMesh& mesh, float x_from_m) {
  SurfaceLoad load;
  load.name = "load";
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    bool inside = true;
    for (const Index v : mesh.triangles[t])
      inside = inside && mesh.positions_m[static_cast<std::size_t>(v)].x >= x_from_m;
    if (inside) load.triangles.push_back(static_cast<Index>(t));
  }
  return load;
}

class LoadsOnDevices : public DrivenOnDevices {};
TACTUS_INSTANTIATE_DEVICES(LoadsOnDevices);

/// A traction of the end of the bar comes to area times traction, at the nodes of the end, whatever the
/// shape; sums of 25 floats: 1e-6.
TEST_P(LoadsOnDevices, TractionIsSharedByArea) {
  Bar bar(GetParam());
  SurfaceLoad load = load_on(boundary_of(bar.lattice), 0.0999F);
  EXPECT_NEAR(area_m2(boundary_of(bar.lattice), load.triangles), kArea_m2, 1e-9);
  load.traction_Pa = {100, -200, 50};
  const Mat3f F{{{1.2F, 0.1F, 0}, {0, 0.9F, 0}, {0.3F, 0, 1}}};
  const std::vector<Vec3f> f = forces_N(bar, load, F);
  const Vec3d all = sum(f);
  EXPECT_NEAR(all.x, 100 * kArea_m2, 1e-6 * 100 * kArea_m2);
  EXPECT_NEAR(all.y, -200 * kArea_m2, 1e-6 * 200 * kArea_m2);
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (bar.lattice.nodes[i].x != 20) {
      EXPECT_LT(length(f[i]), 1e-8F);  // rounding of weights of 0 on 0.01 N
    }
  }
  Bar reference;
  EXPECT_EQ(f, forces_N(reference, load, F));
}

/// Nanson: a flat end of area vector A presses with -p cof(F) A.
TEST_P(LoadsOnDevices, PressureFollowsTheSurface) {
  Bar bar(GetParam());
  SurfaceLoad load = load_on(boundary_of(bar.lattice), 0.0999F);
  load.pressure_Pa = 300;
  const Mat3f F{{{1.2F, 0.1F, 0.2F}, {0, 0.9F, 0.1F}, {0.3F, 0, 1}}};
  const Vec3d all = sum(forces_N(bar, load, F));
  // cof(F) e_x = column y x column z
  const Vec3d expected = -300 * kArea_m2 * cross(Vec3d{0.1, 0.9, 0}, Vec3d{0.2, 0.1, 1});
  EXPECT_LT(length(all - expected), 1e-5 * length(expected));  // gradients from 8 floats of 0.1 m: 2e-6
}

/// All round, pressure cancels out, in force and in moment, however the body is turned.
TEST(Loads, PressureAllRoundIsInBalance) {
  Bar bar;
  SurfaceLoad load = load_on(boundary_of(bar.lattice), -1);
  load.pressure_Pa = 1000;
  const Mat3f R = rotation_matrix(axis_angle(normalized(Vec3f{1, 2, 3}), 1.1F));
  const std::vector<Vec3f> f = forces_N(bar, load, R);
  Vec3d moment;
  for (std::size_t i = 0; i < f.size(); ++i)
    moment += cross(vec_cast<double>(R * bar.lattice.rest_m(static_cast<Index>(i))), vec_cast<double>(f[i]));
  const double scale = 1000 * 0.1 * 0.02;  // on one of the long sides
  EXPECT_LT(length(sum(f)), 1e-5 * scale);
  EXPECT_LT(length(moment), 1e-5 * scale * 0.1);
}

/// mu (s - 1/s) = traction: a dead load on the end. The bar's own rounding as above.
TEST(Loads, TractionStretchesTheBarAsTheClosedForm) {
  Bar bar;
  const TriangleMesh mesh = boundary_of(bar.lattice);
  SurfaceLoad load = load_on(mesh, 0.0999F);
  const double s = 1.05, mu = double{kYoung_Pa} / 2;
  load.traction_Pa.x = mu * (s - 1 / s);
  SurfaceLoads loads(bar.ctx(), bar.lattice, mesh, std::span(&load, 1), all_nodes(bar.lattice));
  const float dt_s = bar.model->stable_step_s();
  for (int k = 0; k < static_cast<int>(1 / dt_s); ++k) {
    loads.apply(bar.ctx(), bar.state, {.dt_s = dt_s, .gravity_m_s2 = {}});
    bar.model->step(bar.ctx(), bar.state, {.dt_s = dt_s, .gravity_m_s2 = {}, .drag_per_s = 50});
  }
  const std::vector<Vec3f> x = bar.x_m();
  for (const Index node : bar.layer(20))
    EXPECT_NEAR(x[static_cast<std::size_t>(node)].x, 0.105, 2e-4 * 0.005);
}

TEST(Loads, FactorsOverTimeAreLinearBetweenKeyframes) {
  Bar bar;
  SurfaceLoad load = load_on(boundary_of(bar.lattice), 0.0999F);
  load.traction_Pa = {1 / kArea_m2, 0, 0};
  load.keys = {{0.1, 0}, {0.3, 4}};
  const Mat3f I = Mat3f::identity();
  EXPECT_NEAR(sum(forces_N(bar, load, I, 1)).x, 0, 1e-6);  // at 0.05 s
  EXPECT_NEAR(sum(forces_N(bar, load, I, 2)).x, 1, 1e-6);  // at 0.15 s
  EXPECT_NEAR(sum(forces_N(bar, load, I, 9)).x, 4, 4e-6);
}

TEST(Loads, ErrorsNameLoadAndKey) {
  Bar bar;
  const TriangleMesh mesh = boundary_of(bar.lattice);
  const auto error_of_load = [&](const SurfaceLoad& load) {
    return test::message_of(
        [&] { SurfaceLoads(bar.ctx(), bar.lattice, mesh, std::span(&load, 1), all_nodes(bar.lattice)); },
        ErrorKind::usage);
  };
  SurfaceLoad load = load_on(mesh, 0.0999F);
  EXPECT_EQ(error_of_load(load), "");
  load.keys = {{0, 1}, {0, 2}};
  EXPECT_EQ(error_of_load(load), "load: keyframe 1 is at 0 s, expected later than the one before, at 0 s");
  load.keys = {{0, std::numeric_limits<double>::infinity()}};
  EXPECT_EQ(error_of_load(load), "load: keyframe 0 holds a value that is not a number");
  load.keys.clear();
  load.pressure_Pa = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of_load(load), "load: its force or pressure is not a number");
  EXPECT_EQ(error_of_load(load_on(mesh, 1)),
            "load: it loads nothing: its region holds no piece of the surface");
}

}  // namespace
}  // namespace tactus
