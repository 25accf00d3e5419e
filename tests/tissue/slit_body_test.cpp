// Bodies whose lattices are cut from the start.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>

#include "support/device_sets.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/multi_device/device_replay.h"
#include "tactus/tissue/body_monitors.h"
#include "tactus/tissue/embedded_surface.h"
#include "tactus/tissue/hybrid/body_solver.h"
#include "tled_bodies.h"

namespace tactus {
namespace {

constexpr ElasticMaterial kMaterial{.young_Pa = 3000, .poisson = 0.4F};

/// Cuts edges along x in the middle of cubes at x = `column`, from y = `bottom` up.
CubeLattice slit(const CubeLattice& whole, Index column, Index bottom, VirtualCapacity capacity = {}) {
  return cut_lattice(
      whole, [=](Vec3i p, int axis) { return axis == 0 && p.x == column && p.y >= bottom; }, capacity);
}

struct Motion {
  std::vector<Vec3f> x_m, v_m_s;
  friend bool operator==(const Motion&, const Motion&) = default;
};

/// Nodes that are not in use stand still.
std::vector<Vec3f> wild(const CubeLattice& lattice) {
  std::vector<Vec3f> v;
  for (const Vec3f p : lattice.rest_positions_m())
    v.push_back({-9 * p.z + 0.2F, 6 * p.x * (p.y > 0.01F ? 1.F : -1.F), 9 * p.x - 2 * p.y});
  for (std::size_t i = 0; i < v.size(); ++i)
    if (!(lattice.node_mass_kg[i] > 0)) v[i] = {};
  return v;
}

Motion run_elements(const CubeLattice& lattice, const TledOptions& options, int substeps) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  Tled body(ctx, lattice, {&kMaterial, 1}, {}, options);
  BodyState state = rest_state(ctx, lattice);
  state.v_m_s = to_device(ctx, wild(lattice));
  body.step(ctx, state, {.dt_s = 2e-4F}, substeps);
  return {to_host(ctx, state.x_m.const_view()), to_host(ctx, state.v_m_s.const_view())};
}

/// Half of a block that is slit through: its last (or first) cubes along x are half full.
CubeLattice half(Vec3i cubes, Vec3f origin_m, Index half_full_column) {
  CubeLattice lattice = lattice_from_box(origin_m, cubes, {.spacing_m = kH});
  lattice.cube_fill.assign(lattice.cubes.size(), 1);
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
    if (lattice.cubes[c].x != half_full_column) continue;
    lattice.cube_fill[c] = 0.5F;
    lattice.cube_mass_kg[c] *= 0.5F;
  }
  lattice.share_masses();
  return lattice;
}

/// Sums of forces are grouped in another way: equal to rounding. Positions of 0.03 m are rounded to 1.9e-9 m,
/// once a substep; 200 such errors walk to 14 of them. A body that is soft enough to swing with 10 times
/// that has 3e-7 m.
TEST(SlitBody, SlitThroughMovesAsTwoBodies) {
  for (const bool relaxes : {false, true}) {
    TledOptions options;
    if (relaxes) options.relaxation[0] = {.share = 0.4F, .time_s = 0.02F};
    const CubeLattice whole = box({5, 4, 3});
    const Motion both = run_elements(slit(whole, 2, 0), options, 200);
    const CubeLattice left = half({3, 4, 3}, {}, 2), right = half({3, 4, 3}, {2 * kH, 0, 0}, 0);
    const Motion apart[2] = {run_elements(left, options, 200), run_elements(right, options, 200)};
    float farthest_m = 0, moved_m = 0;
    for (Index i = 0; i < whole.node_count(); ++i) {
      const Vec3i p = whole.nodes[at(i)];
      const bool is_left = p.x <= 2;
      const CubeLattice& own = is_left ? left : right;
      const Vec3i q = is_left ? p : p - Vec3i{2, 0, 0};
      const auto node =
          static_cast<std::size_t>(std::find(own.nodes.begin(), own.nodes.end(), q) - own.nodes.begin());
      farthest_m = max(farthest_m, length(both.x_m[at(i)] - apart[is_left ? 0 : 1].x_m[node]));
      moved_m = max(moved_m, length(both.x_m[at(i)] - whole.rest_m(i)));
    }
    EXPECT_LT(farthest_m, 3e-7F);
    EXPECT_GT(moved_m, 2e-3F);
  }
}

/// Stiffness of an 8-node brick of edge 1 with 2x2x2 points, in double, from the textbook: K = sum B^T D B.
std::array<std::array<double, 24>, 24> brick_stiffness(double young, double nu) {
  const double mu = young / (2 * (1 + nu)), lambda = young * nu / ((1 + nu) * (1 - 2 * nu));
  std::array<std::array<double, 24>, 24> K{};
  for (int point = 0; point < 8; ++point) {
    const double g = 0.5 / std::sqrt(3.0);
    const double at_point[3] = {0.5 + ((point & 1) != 0 ? g : -g), 0.5 + ((point & 2) != 0 ? g : -g),
                                0.5 + ((point & 4) != 0 ? g : -g)};
    double dN[8][3];
    for (int q = 0; q < 8; ++q) {
      for (int a = 0; a < 3; ++a) {
        dN[q][a] = (q >> a & 1) != 0 ? 1 : -1;
        for (int b = 0; b < 3; ++b)
          if (b != a) dN[q][a] *= (q >> b & 1) != 0 ? at_point[b] : 1 - at_point[b];
      }
    }
    for (int p = 0; p < 8; ++p)
      for (int q = 0; q < 8; ++q)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) {
            double k = lambda * dN[p][i] * dN[q][j] + mu * dN[p][j] * dN[q][i];
            if (i == j)
              for (int a = 0; a < 3; ++a) k += mu * dN[p][a] * dN[q][a];
            K[at(3 * p + i)][at(3 * q + j)] += k / 8;
          }
  }
  return K;
}

/// The half-slit block as another program would write it: nodes by coordinates and side, no virtual nodes.
class LinearSlit {
 public:
  static constexpr Index kColumn = 2, kBottom = 2;
  static constexpr Vec3i kCubes{5, 5, 2};

  LinearSlit() {
    const auto K = brick_stiffness(double{kMaterial.young_Pa}, double{kMaterial.poisson});
    for (Index z = 0; z < kCubes.z; ++z)
      for (Index y = 0; y < kCubes.y; ++y)
        for (Index x = 0; x < kCubes.x; ++x) {
          if (x != kColumn || y < kBottom)
            add(K, {x, y, z}, 0, 1);
          else
            for (const int side : {-1, 1}) add(K, {x, y, z}, side, 0.5);
        }
  }
  /// Node of a cube's side: beyond the slit and above its end a cube's half has nodes of its own.
  Index node(Vec3i p, int side) {
    const bool is_beyond = side < 0 ? p.x > kColumn : p.x <= kColumn;
    const int own = side != 0 && is_beyond && p.y > kBottom ? side : 0;
    return id_.try_emplace({p.x, p.y, p.z, own}, static_cast<Index>(id_.size())).first->second;
  }
  /// u with K u = f, where y > 0; conjugate gradients. Times spacing: K is that of cubes of edge 1.
  std::vector<double> solve(const std::map<Index, double>& force_x_N) {
    const std::size_t n = 3 * id_.size();
    std::vector<double> u(n), r(n), q(n);
    for (const auto& [i, f] : force_x_N) r[at(3 * i)] = f;
    std::vector<double> p = r;
    const auto dot_of = [](const auto& a, const auto& b) {
      return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
    };
    double rr = dot_of(r, r);
    const double first = rr;
    for (int k = 0; k < 5000 && rr > 1e-24 * first; ++k) {
      std::fill(q.begin(), q.end(), 0);
      for (const auto& [ij, value] : K_) q[at(ij.first)] += value * p[at(ij.second)];
      for (const auto& [key, i] : id_)
        if (key[1] == 0)
          for (Index a = 0; a < 3; ++a) q[at(3 * i + a)] = 0;
      const double alpha = rr / dot_of(p, q);
      for (std::size_t i = 0; i < n; ++i) u[i] += alpha * p[i], r[i] -= alpha * q[i];
      const double next = dot_of(r, r);
      for (std::size_t i = 0; i < n; ++i) p[i] = r[i] + next / rr * p[i];
      rr = next;
    }
    return u;
  }

 private:
  void add(const std::array<std::array<double, 24>, 24>& K, Vec3i cube, int side, double share) {
    Index ids[8];
    for (int q = 0; q < 8; ++q) ids[q] = node(cube + Vec3i{q & 1, q >> 1 & 1, q >> 2}, side);
    for (Index i = 0; i < 24; ++i)
      for (Index j = 0; j < 24; ++j)
        K_[{3 * ids[i / 3] + i % 3, 3 * ids[j / 3] + j % 3}] += share * K[at(i)][at(j)];
  }
  std::map<std::array<Index, 4>, Index> id_;
  std::map<std::pair<Index, Index>, double> K_;
};

/// How far the lips of the slit are apart at the top when they are pulled apart, by mean displacement.
class HalfSlit : public testing::Test {
 protected:
  static bool is_lip(Vec3i p) {
    return p.y == LinearSlit::kCubes.y && (p.x == LinearSlit::kColumn || p.x == LinearSlit::kColumn + 1);
  }
  /// With the force turned round, too: what is quadratic in it drops out.
  static double opening_of_body_m(const CubeLattice& lattice, float force_N) {
    double opening_m = 0;
    for (const float sign : {1.F, -1.F}) {
      DeviceSet set("cpu");
      ExecContext& ctx = set.context(0);
      Tled body(ctx, lattice, {&kMaterial, 1}, {}, {.full_integration = true});
      BodyState state = rest_state(ctx, lattice);
      std::vector<Vec3f> f(lattice.nodes.size());
      for (Index i = 0; i < lattice.regular_nodes(); ++i)
        if (is_lip(lattice.nodes[at(i)]))
          f[at(i)].x = sign * (lattice.nodes[at(i)].x == LinearSlit::kColumn ? -force_N : force_N);
      state.f_ext_N = to_device(ctx, f);
      body.step(ctx, state, {.dt_s = body.stable_step_s(), .gravity_m_s2 = {}, .drag_per_s = 60}, 6000);
      const auto x = to_host(ctx, state.x_m.const_view());
      for (Index i = 0; i < lattice.regular_nodes(); ++i)
        if (is_lip(lattice.nodes[at(i)]))
          opening_m += static_cast<double>(f[at(i)].x / force_N * (x[at(i)].x - lattice.rest_m(i).x)) /
                       (2 * (LinearSlit::kCubes.z + 1));
    }
    return opening_m;
  }
};

/// u / h is 0.003: cubic terms are 1e-5 of the linear ones. Positions of 0.025 m are rounded to 1.9e-9 m, of
/// an opening of 3e-5 m that is 6e-5. So 0.2 % leaves capacity for what drag has not settled yet.
TEST_F(HalfSlit, OpensAsTheStiffnessOfItsCubesSays) {
  constexpr float kForce_N = 2e-5F;
  CubeLattice whole = lattice_from_box({}, LinearSlit::kCubes, {.spacing_m = kH});
  whole.fix_where([](Vec3f p) { return p.y < 0.1F * kH; });
  LinearSlit linear;
  std::map<Index, double> force;
  for (Index z = 0; z <= LinearSlit::kCubes.z; ++z)
    for (const Index side : {0, 1})
      force[linear.node({LinearSlit::kColumn + side, LinearSlit::kCubes.y, z}, 0)] =
          (side == 0 ? -1.0 : 1.0) * double{kForce_N};
  const std::vector<double> u = linear.solve(force);
  double expected_m = 0;
  for (const auto& [node, f] : force)
    expected_m += f / double{kForce_N} * u[at(3 * node)] / double{kH} / (LinearSlit::kCubes.z + 1);
  const double opening_m = opening_of_body_m(slit(whole, LinearSlit::kColumn, LinearSlit::kBottom), kForce_N);
  EXPECT_NEAR(opening_m, expected_m, 0.002 * expected_m);
  EXPECT_GT(opening_m, 5 * opening_of_body_m(whole, kForce_N));
}

/// Cubes that were cut, and capacity, count neither as volume nor as inverted.
TEST(SlitBody, HasTheVolumeOfTheWhole) {
  const CubeLattice whole = box({5, 4, 3}), lattice = slit(whole, 2, 1, {.copies = 30, .nodes = 40});
  std::vector<Vec3f> x = lattice.rest_positions_m();
  const BodyMonitors m = measure_body(lattice, {}, {&kMaterial, 1}, {}, {}, x, std::vector<Vec3f>(x.size()));
  EXPECT_NEAR(m.volume_m3, 60 * std::pow(double{kH}, 3), 1e-6 * m.volume_m3);
  EXPECT_EQ(m.inverted_cubes, 0);
  EXPECT_NEAR(m.min_J, 1, 1e-5);
}

TEST(SlitBody, KeepsItsMomentum) {
  const CubeLattice lattice = slit(box({5, 4, 3}), 2, 1);
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  Tled body(ctx, lattice, {&kMaterial, 1});
  BodyState state = rest_state(ctx, lattice);
  state.v_m_s = to_device(ctx, wild(lattice));
  const auto momentum = [&] {
    Vec3d sum{};
    double size = 0;
    const auto v = to_host(ctx, state.v_m_s.const_view());
    for (std::size_t i = 0; i < v.size(); ++i) {
      const Vec3d p = static_cast<double>(lattice.node_mass_kg[i]) * vec_cast<double>(v[i]);
      sum += p;
      size += length(p);
    }
    return std::pair(sum, size);
  };
  const auto [before, size] = momentum();
  body.step(ctx, state, {.dt_s = body.stable_step_s(), .gravity_m_s2 = {}}, 300);
  // 300 steps, each rounded to 6e-8 of the nodes' momenta, which add up like a walk: 1e-6.
  EXPECT_LT(length(momentum().first - before), 2e-6 * size);
}

/// A box of the body's surface, its corners in spacings.
void add_box(TriangleMesh& mesh, Vec3f low, Vec3f high) {
  const auto first = static_cast<Index>(mesh.positions_m.size());
  for (int q = 0; q < 8; ++q)
    mesh.positions_m.push_back(kH * Vec3f{(q & 1) != 0 ? high.x : low.x, (q & 2) != 0 ? high.y : low.y,
                                          (q & 4) != 0 ? high.z : low.z});
  constexpr Index kCorners[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                    {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& c : kCorners) {
    mesh.triangles.push_back({first + c[0], first + c[1], first + c[2]});
    mesh.triangles.push_back({first + c[0], first + c[2], first + c[3]});
  }
}

/// Both walls of a slit lie in one plane, in the middle of cubes. Each moves with its own side.
TEST(SlitBody, WallsMoveWithTheirSides) {
  const CubeLattice whole = box({5, 4, 3}), lattice = slit(whole, 2, 0);
  TriangleMesh mesh;
  add_box(mesh, {0, 0, 0}, {2.5F, 4, 3});
  add_box(mesh, {2.5F, 0, 0}, {5, 4, 3});
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  EmbeddedSurface surface(ctx, lattice, mesh);
  BodyState state = rest_state(ctx, lattice);
  std::vector<Vec3f> x = lattice.rest_positions_m();
  for (Index i = 0; i < lattice.node_count(); ++i) {
    const bool is_virtual = i >= lattice.regular_nodes();
    if ((lattice.nodes[at(i)].x <= 2) != is_virtual) x[at(i)].x -= 0.01F;
  }
  state.x_m = to_device(ctx, x);
  surface.update(ctx, state);
  const TriangleMesh moved = surface.to_mesh(ctx);
  for (std::size_t v = 0; v < 16; ++v)
    EXPECT_NEAR(moved.positions_m[v].x, mesh.positions_m[v].x - (v < 8 ? 0.01F : 0.F), 1e-8F) << v;
}

class SlitDevices : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(SlitDevices);

/// Cut along and across the slabs' layers, where y is low, with capacity to spare.
CubeLattice cross_cut(const CubeLattice& whole) {
  const Index mid = whole.node_dims.z / 2;
  return cut_lattice(whole,
                     [=](Vec3i p, int axis) {
                       return p.y <= 2 && ((axis == 0 && p.x == 2) ||
                                           (axis == 2 && p.x >= 2 && (p.z == mid || p.z == mid - 6)));
                     },
                     {.copies = 500, .nodes = 700});
}

Motion on_slabs(DeviceSet& devices, const CubeLattice& lattice, const ElementMask& elements,
                const TledOptions& options) {
  BodySolver body(devices,
                  {.lattice = lattice,
                   .elements = elements,
                   .materials = {&kMaterial, 1},
                   .tled = options,
                   .flsm = {.young_Pa = 3000, .half_width = 1}},
                  {.least_elements = 0});
  body.set_state(lattice.rest_positions_m(), wild(lattice));
  DeviceReplay replay;
  for (int k = 0; k < 3; ++k) replay.run(devices, [&] { body.step({.dt_s = body.stable_step_s()}, 5); });
  body.end_frame(5);
  Motion motion{body.positions_m(), body.velocities_m_s()};
  EXPECT_EQ(to_host(devices.context(0), body.body().x_m.const_view()), motion.x_m);
  return motion;
}

TEST_P(SlitDevices, MovesWithTheSameBits) {
  const CubeLattice whole = lattice_from_box({}, {4, 4, 48}, {.spacing_m = kH}), lattice = cross_cut(whole);
  const ElementMask half_elements = with_copies(lattice, split_by_ratio(whole, 1, 2, 1));
  TledOptions relaxing;
  relaxing.relaxation[0] = {.share = 0.4F, .time_s = 0.02F};
  DeviceSet one("cpu");
  DeviceSet devices(GetParam(), 9);
  EXPECT_TRUE(on_slabs(devices, lattice, {}, {}) == on_slabs(one, lattice, {}, {}));
  EXPECT_TRUE(on_slabs(devices, lattice, {}, relaxing) == on_slabs(one, lattice, {}, relaxing));
  // With shape matching, nodes go back to the body after every substep.
  EXPECT_TRUE(on_slabs(devices, lattice, half_elements, {}) == on_slabs(one, lattice, half_elements, {}));
}

TEST(SlitBody, AnyLegalOrderGivesTheSameBits) {
  const CubeLattice lattice = cross_cut(lattice_from_box({}, {4, 4, 30}, {.spacing_m = kH}));
  DeviceSet one("cpu");
  const Motion expected = on_slabs(one, lattice, {}, {});
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    DeviceSet devices("cpu:3", seed);
    ASSERT_TRUE(on_slabs(devices, lattice, {}, {}) == expected) << "seed " << seed;
  }
}

/// A copy that is crushed is found as a cube would be: its volume, and its number. The uncut block has the
/// same cube crushed the same way.
TEST_P(SlitDevices, StrainOfCopiesIsFound) {
  DeviceSet devices(GetParam(), 13);
  const CubeLattice whole = lattice_from_box({}, {4, 4, 48}, {.spacing_m = kH}), lattice = cross_cut(whole);
  const auto extremes = [&](const CubeLattice& of, Index cube) {
    BodySolver body(devices, {.lattice = of, .materials = {&kMaterial, 1}}, {.least_elements = 0});
    std::vector<Vec3f> x = of.rest_positions_m();
    const auto& nodes = of.cube_nodes[at(cube)];
    for (std::size_t q = 4; q < 8; ++q) x[at(nodes[q])].z -= 0.7F * kH;
    body.set_state(x, std::vector<Vec3f>(x.size()));
    body.end_frame(1);
    return body.extremes();
  };
  const Index copy = lattice.regular_cubes();  // the first
  const tled::CubeExtremes cut = extremes(lattice, copy), uncut = extremes(whole, lattice.copies[0].of);
  EXPECT_EQ(cut.smallest_cube, copy);
  EXPECT_EQ(cut.smallest_J, uncut.smallest_J);
  EXPECT_EQ(cut.inverted, 0);
  EXPECT_EQ(uncut.smallest_cube, lattice.copies[0].of);
}

/// A virtual node that isn't a number is found on every device set, with its number. (It is checked, not
/// cured.)
TEST_P(SlitDevices, BadVirtualNodesAreFound) {
  DeviceSet devices(GetParam(), 14);
  const CubeLattice lattice = cross_cut(lattice_from_box({}, {4, 4, 48}, {.spacing_m = kH}));
  BodySolver body(devices, {.lattice = lattice, .materials = {&kMaterial, 1}}, {.least_elements = 0});
  for (const Index k : {0, 40, 83}) {
    const Index bad = lattice.regular_nodes() + k;
    std::vector<Vec3f> x = lattice.rest_positions_m();
    x[at(bad)].y = std::nanf("");
    body.set_state(x, std::vector<Vec3f>(x.size()));
    body.begin_frame();
    body.end_frame(1);
    EXPECT_EQ(body.node_check().bad_node, bad);
  }
}

/// Capacity that nothing uses changes no bit.
TEST(SlitBody, CapacityChangesNothing) {
  const CubeLattice whole = box({5, 4, 3});
  const auto none = [](Vec3i, int) { return false; };
  const Motion without = run_elements(whole, {}, 50),
               with = run_elements(cut_lattice(whole, none, {.copies = 30, .nodes = 40}), {}, 50);
  for (std::size_t i = 0; i < without.x_m.size(); ++i) ASSERT_TRUE(with.x_m[i] == without.x_m[i]);
}

}  // namespace
}  // namespace tactus
