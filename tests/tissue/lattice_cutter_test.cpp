// A blade that sweeps through the lattice of a body.
#include "tactus/tissue/cut/lattice_cutter.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <numeric>
#include <random>
#include <set>

#include "tactus/geom/lattice/lattice_cut.h"

namespace tactus::cut {
namespace {

constexpr float kSpacing = 0.01F;
std::size_t at(Index i) { return static_cast<std::size_t>(i); }

CubeLattice block(Vec3i cubes, VirtualCapacity capacity) {
  return cut_lattice(
      lattice_from_box({}, cubes, {.spacing_m = kSpacing}), [](Vec3i, int) { return false; }, capacity);
}

/// A straight edge from a to b that moves to c and d; in spacings.
BladeStrip strip(Vec3f a, Vec3f b, Vec3f c, Vec3f d) {
  return {{kSpacing * a, kSpacing * b}, {kSpacing * c, kSpacing * d}, 0};
}
/// Across a block of n cubes an edge, in the plane x = `at`, for y from..to.
BladeStrip plane_x(float x, float from, float to, float n) {
  return strip({x, from, -1}, {x, from, n + 1}, {x, to, -1}, {x, to, n + 1});
}
BladeStrip plane_y(float y, float n) {
  return strip({-1, y, -1}, {-1, y, n + 1}, {n + 1, y, -1}, {n + 1, y, n + 1});
}
BladeStrip plane_z(float z, float n) {
  return strip({-1, -1, z}, {-1, n + 1, z}, {n + 1, -1, z}, {n + 1, n + 1, z});
}

/// Cuts, with half the material on each side.
TopologyChange cut(LatticeCutter& cutter, const BladeStrip& s) {
  cutter.mark(s, cutter.lattice().rest_positions_m());
  const auto stages = cutter.splits();
  for (const auto& stage : stages) cutter.divide(stage, std::vector<double>(stage.size(), 0.5));
  TopologyChange change;
  cutter.commit(stages, change);
  return change;
}

/// What every cut lattice is: masses are kept, corners that are a copy's own have the regular node, a cube
/// has eight nodes at its corners, and corners of a cube belong to one of its copies each.
void expect_sound(const LatticeCutter& cutter, double mass_kg) {
  const CubeLattice& lattice = cutter.lattice();
  EXPECT_NEAR(lattice.mass_kg(), mass_kg, 1e-6 * mass_kg);
  EXPECT_NEAR(std::accumulate(lattice.node_mass_kg.begin(), lattice.node_mass_kg.end(), 0.0), mass_kg,
              1e-6 * mass_kg);
  std::vector<int> owners(8 * at(lattice.regular_cubes()));
  for (Index c = 0; c < lattice.cube_count(); ++c) {
    if (!lattice.has_cube(at(c))) continue;
    const Index regular = cutter.regular_of(c);
    for (int q = 0; q < 8; ++q) {
      const Index node = lattice.cube_nodes[at(c)][at(q)];
      ASSERT_TRUE(lattice.nodes[at(node)] == lattice.cubes[at(c)] + (Vec3i{q & 1, q >> 1 & 1, q >> 2}));
      ASSERT_GT(lattice.node_mass_kg[at(node)], 0.F);
      if ((cutter.corners(c) >> q & 1) == 0) continue;
      ++owners[at(8 * regular + q)];
      ASSERT_EQ(node, lattice.cube_nodes[at(regular)][at(q)]);
    }
  }
  for (const int n : owners) ASSERT_EQ(n, 1);
}

Index nodes_in_use(const LatticeCutter& cutter) {
  const std::vector<Index>& nodes = cutter.lattice().virtual_nodes;
  return static_cast<Index>(std::count_if(nodes.begin(), nodes.end(), [](Index of) { return of >= 0; }));
}

TEST(LatticeCutter, PlanesMakeTwoFourAndEightParts) {
  const CubeLattice whole = block({20, 20, 20}, {.copies = 6000, .nodes = 6000});
  LatticeCutter cutter(whole);
  EXPECT_EQ(cutter.part_count(), 1);
  cut(cutter, plane_x(9.3F, -1, 21, 20));
  EXPECT_EQ(cutter.part_count(), 2);
  EXPECT_EQ(cutter.copies_in_use(), 800);
  EXPECT_EQ(nodes_in_use(cutter), 2 * 21 * 21);
  expect_sound(cutter, whole.mass_kg());
  cut(cutter, plane_y(7.6F, 20));
  EXPECT_EQ(cutter.part_count(), 4);
  cut(cutter, plane_z(11.5F, 20));
  EXPECT_EQ(cutter.part_count(), 8);
  expect_sound(cutter, whole.mass_kg());
}

/// The same copies and nodes as the lattice that is cut by its edges.
TEST(LatticeCutter, AgreesWithTheLatticeThatIsCutByItsEdges) {
  LatticeCutter cutter(block({6, 5, 4}, {.copies = 300, .nodes = 300}));
  cut(cutter, plane_x(2.5F, 1.5F, 6, 4));
  const CubeLattice expected =
      cut_lattice(lattice_from_box({}, {6, 5, 4}, {.spacing_m = kSpacing}),
                  [](Vec3i p, int axis) { return axis == 0 && p.x == 2 && p.y >= 2; });
  EXPECT_EQ(cutter.copies_in_use(), static_cast<Index>(expected.copies.size()));
  EXPECT_EQ(nodes_in_use(cutter), static_cast<Index>(expected.virtual_nodes.size()));
  for (std::size_t c = 0; c < expected.copies.size(); ++c) {
    EXPECT_EQ(cutter.lattice().copies[c].of, expected.copies[c].of);
    EXPECT_EQ(cutter.lattice().copies[c].corners, expected.copies[c].corners);
  }
}

/// The strip ends in the middle of the block: the rest waits, and the end of the slit shares its nodes.
TEST(LatticeCutter, HalfACutOpensAndWaits) {
  const CubeLattice whole = block({20, 20, 20}, {.copies = 3000, .nodes = 3000});
  LatticeCutter cutter(whole);
  cut(cutter, plane_x(9.3F, -1, 9.5F, 20));
  EXPECT_EQ(cutter.part_count(), 1);
  EXPECT_EQ(cutter.copies_in_use(), 2 * 9 * 20);
  EXPECT_EQ(nodes_in_use(cutter), 2 * 9 * 21);
  expect_sound(cutter, whole.mass_kg());
  // The row of cubes in which the strip ended is cut by the next one, wherever it begins.
  const TopologyChange rest = cut(cutter, plane_x(9.3F, 9.5F, 21, 20));
  EXPECT_EQ(cutter.part_count(), 2);
  EXPECT_EQ(cutter.copies_in_use(), 800);
  EXPECT_EQ(nodes_in_use(cutter), 2 * 21 * 21);
  EXPECT_GT(rest.copies.size(), 2U * 11 * 20);  // and copies at the end of the slit, with new nodes
  expect_sound(cutter, whole.mass_kg());
}

TEST(LatticeCutter, TheSamePlaneAgainAddsNothing) {
  LatticeCutter cutter(block({20, 20, 20}, {.copies = 3000, .nodes = 3000}));
  cut(cutter, plane_x(9.3F, -1, 21, 20));
  const Index copies = cutter.copies_in_use(), nodes = nodes_in_use(cutter);
  for (const float x : {9.3F, 9.31F, 9.1F}) {
    const TopologyChange again = cut(cutter, plane_x(x, -1, 21, 20));
    EXPECT_TRUE(again.cut.empty() && again.copies.empty() && again.nodes.empty());
  }
  EXPECT_EQ(cutter.copies_in_use(), copies);
  EXPECT_EQ(nodes_in_use(cutter), nodes);
}

/// One half has moved away; a strip through it alone leaves the other as it is.
TEST(LatticeCutter, CutsOneHalfAlone) {
  const CubeLattice whole = block({8, 8, 8}, {.copies = 900, .nodes = 900});
  LatticeCutter cutter(whole);
  cut(cutter, plane_x(4.5F, -1, 9, 8));
  std::vector<Vec3f> x = cutter.lattice().rest_positions_m();
  for (Index c = 0; c < cutter.lattice().cube_count(); ++c) {
    if (!cutter.lattice().has_cube(at(c))) continue;
    const std::uint8_t own = cutter.corners(c);
    const Vec3i p = cutter.lattice().cubes[at(c)];
    if (p.x > 4 || (p.x == 4 && (own & 1) == 0))
      for (const Index i : cutter.lattice().cube_nodes[at(c)])
        x[at(i)].x = cutter.lattice().rest_m(i).x + 1.F;
  }
  cutter.mark(plane_y(3.5F, 8), x);
  const auto stages = cutter.splits();
  ASSERT_EQ(stages.size(), 1U);
  cutter.divide(stages[0], std::vector<double>(stages[0].size(), 0.5));
  TopologyChange change;
  cutter.commit(stages, change);
  EXPECT_EQ(cutter.part_count(), 3);
  EXPECT_EQ(cutter.copies_in_use(), 2 * 64 + 2 * 5 * 8);
  expect_sound(cutter, whole.mass_kg());
}

TEST(LatticeCutter, AFullPatchKeepsTheCutForLater) {
  for (const VirtualCapacity capacity : {VirtualCapacity{50, 900}, VirtualCapacity{900, 50}}) {
    const CubeLattice whole = block({8, 8, 8}, capacity);
    LatticeCutter cutter(whole);
    const TopologyChange none = cut(cutter, plane_x(4.5F, -1, 9, 8));
    EXPECT_TRUE(cutter.is_full());
    EXPECT_TRUE(none.copies.empty());
    EXPECT_EQ(cutter.part_count(), 1);
    EXPECT_EQ(cutter.copies_in_use(), 0);
    expect_sound(cutter, whole.mass_kg());
  }
}

/// A cut that ends where the next one begins, at places that are and are not exact, over a lattice that it
/// meets in nodes, edges and faces: nothing is left between them. So a plane in n strips severs as one does.
TEST(LatticeCutter, StripsThatFollowOneAnotherLeaveNoGap) {
  for (const float x : {4.F, 4.5F, 4.25F}) {
    for (const float step : {0.5F, 1.F, 0.37F}) {
      LatticeCutter cutter(block({8, 8, 8}, {.copies = 900, .nodes = 900}));
      int frame = 0;
      for (float y = -1; y < 9; y += step) {
        BladeStrip s = plane_x(x, y, y + step, 8);
        s.frame = frame++;
        cut(cutter, s);
      }
      EXPECT_EQ(cutter.part_count(), 2) << x << " " << step;
      EXPECT_EQ(cutter.copies_in_use(), 2 * 64);
    }
  }
}

/// Of strips in every position, a third of them exactly on nodes, edges and faces, three to a block.
TEST(LatticeCutter, RandomStripsLoseNothing) {
  const bool is_long = std::getenv("TACTUS_LONG_TESTS") != nullptr;
  const Index n = is_long ? 20 : 6;
  const CubeLattice whole = block({n, n, n}, {.copies = 8 * n * n * n, .nodes = 20 * n * n * n});
  for (unsigned seed = 0; seed < (is_long ? 334U : 60U); ++seed) {
    std::mt19937 random(seed);
    LatticeCutter cutter(whole);
    for (int k = 0; k < 3; ++k) {
      const float grid = seed % 3 == 0 ? 1.F : 0;
      const auto point = [&] {
        Vec3f p;
        for (int a = 0; a < 3; ++a) {
          p[a] = std::uniform_real_distribution<float>(-1, static_cast<float>(n) + 1)(random);
          if (grid > 0) p[a] = std::round(p[a]);
        }
        return p;
      };
      cut(cutter, strip(point(), point(), point(), point()));
      ASSERT_FALSE(cutter.is_full());
      expect_sound(cutter, whole.mass_kg());
      if (HasFatalFailure()) FAIL() << seed;
    }
  }
}

/// Signs of points in general position, of which many lie in one plane, one line or one place: swapping two
/// changes the sign, and a segment through a closed surface crosses it an even number of times.
TEST(ExactSign, HasNoTies) {
  std::mt19937 random(3);
  std::uniform_int_distribution<int> small(0, 2);
  const auto point = [&](int id) {
    return NamedPoint{{static_cast<float>(small(random)), static_cast<float>(small(random)),
                       static_cast<float>(small(random))},
                      id};
  };
  for (int k = 0; k < 3000; ++k) {
    const NamedPoint a = point(1), b = point(2), c = point(3), d = point(4);
    const int s = orientation(a, b, c, d);
    ASSERT_EQ(orientation(b, a, c, d), -s);
    ASSERT_EQ(orientation(a, c, b, d), -s);
    ASSERT_EQ(orientation(a, b, d, c), -s);
    ASSERT_EQ(orientation(b, c, a, d), s);
    const NamedPoint e = point(5), f = point(6);
    int times = 0;
    for (const auto& [u, v, w] : {std::array{a, b, c}, {a, c, d}, {a, d, b}, {b, d, c}}) {
      const NamedTriangle triangle(u, v, w);
      const NamedTriangle::End of_e = triangle.end(e), of_f = triangle.end(f);
      ASSERT_EQ(of_e.side, orientation(e, u, v, w)) << k;
      const int round = orientation(e, f, u, v);
      const bool is_met =
          of_e.side != of_f.side && orientation(e, f, v, w) == round && orientation(e, f, w, u) == round;
      ASSERT_EQ(triangle.crossing(e, of_e, f, of_f) >= 0, is_met) << k;
      times += is_met ? 1 : 0;
    }
    const auto inside = [&](const NamedPoint& p) {
      return orientation(p, b, c, d) == s && orientation(a, p, c, d) == s && orientation(a, b, p, d) == s &&
             orientation(a, b, c, p) == s;
    };
    ASSERT_EQ(times % 2 == 1, inside(e) != inside(f)) << k;
  }
  EXPECT_EQ(orientation({{0, 0, 0}, 1}, {{1, 0, 0}, 2}, {{0, 1, 0}, 3}, {{0, 0, 1}, 4}), 1);
}

}  // namespace
}  // namespace tactus::cut
