#include "tactus/geom/lattice/lattice_cut.h"

#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <random>

namespace tactus {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

CubeLattice block(Vec3i cubes) { return lattice_from_box({0, 0, 0}, cubes, {.spacing_m = 0.01F}); }

/// Cuts the edges that cross the middle of a layer of cubes, where the node in front of it lies in `where`.
EdgeIsCut plane(
    int axis, Index layer, const std::function<bool(Vec3i)>& where = [](Vec3i) { return true; }) {
  return [=](Vec3i from, int along) { return along == axis && from[axis] == layer && where(from); };
}

EdgeIsCut either(const EdgeIsCut& a, const EdgeIsCut& b) {
  return [=](Vec3i from, int axis) { return a(from, axis) || b(from, axis); };
}

/// Bodies that nodes hold together.
int parts(const CubeLattice& lattice) {
  std::vector<Index> part(lattice.nodes.size());
  std::iota(part.begin(), part.end(), 0);
  for (bool changes = true; changes;) {
    changes = false;
    for (std::size_t c = 0; c < lattice.cubes.size(); ++c) {
      if (!lattice.has_cube(c)) continue;
      Index least = part[at(lattice.cube_nodes[c][0])];
      for (const Index i : lattice.cube_nodes[c]) least = std::min(least, part[at(i)]);
      for (const Index i : lattice.cube_nodes[c]) {
        changes = changes || part[at(i)] != least;
        part[at(i)] = least;
      }
    }
  }
  std::map<Index, int> found;
  for (std::size_t c = 0; c < lattice.cubes.size(); ++c)
    if (lattice.has_cube(c)) ++found[part[at(lattice.cube_nodes[c][0])]];
  return static_cast<int>(found.size());
}

/// What every cut lattice is: mass and fill are kept, nodes and cubes stand where they should, and a corner
/// that is a copy's own is the regular node.
void expect_sound(const CubeLattice& cut, const CubeLattice& whole) {
  // Shares are eighths, so sums of a few hundred of them are exact but for 24 bits.
  EXPECT_NEAR(cut.mass_kg(), whole.mass_kg(), 1e-6 * whole.mass_kg());
  EXPECT_NEAR(std::accumulate(cut.node_mass_kg.begin(), cut.node_mass_kg.end(), 0.0), whole.mass_kg(),
              1e-5 * whole.mass_kg());
  EXPECT_EQ(cut.regular_nodes(), whole.node_count());
  EXPECT_EQ(cut.regular_cubes(), whole.cube_count());
  std::vector<float> fill(whole.cubes.size());
  for (Index c = 0; c < cut.cube_count(); ++c) {
    const std::size_t regular = at(c < cut.regular_cubes() ? c : cut.copies[at(c - cut.regular_cubes())].of);
    fill[regular] += cut.cube_fill[at(c)];
    for (int q = 0; q < 8; ++q) {
      const Index node = cut.cube_nodes[at(c)][at(q)];
      const Vec3i corner{q & 1, q >> 1 & 1, q >> 2};
      ASSERT_TRUE(cut.nodes[at(node)] == cut.cubes[at(c)] + corner);
      const bool is_own =
          c < cut.regular_cubes() || (cut.copies[at(c - cut.regular_cubes())].corners >> q & 1) != 0;
      if (is_own) {
        EXPECT_EQ(node, whole.cube_nodes[regular][at(q)]);
      }
    }
  }
  for (const float f : fill) EXPECT_EQ(f, 1.F);
  for (std::size_t k = 0; k < cut.virtual_nodes.size(); ++k)
    EXPECT_TRUE(cut.nodes[at(cut.regular_nodes()) + k] == cut.nodes[at(cut.virtual_nodes[k])]);
}

TEST(LatticeCut, NothingCutIsTheSameLattice) {
  const CubeLattice whole = block({3, 4, 2});
  const CubeLattice cut = cut_lattice(whole, [](Vec3i, int) { return false; });
  expect_sound(cut, whole);
  EXPECT_TRUE(cut.copies.empty());
  EXPECT_TRUE(cut.virtual_nodes.empty());
  EXPECT_EQ(cut.node_mass_kg, whole.node_mass_kg);
}

TEST(LatticeCut, APlaneThroughMakesTwoParts) {
  const CubeLattice whole = block({5, 3, 2});
  const CubeLattice cut = cut_lattice(whole, plane(0, 2));
  expect_sound(cut, whole);
  EXPECT_EQ(parts(cut), 2);
  EXPECT_EQ(cut.copies.size(), 2U * 3 * 2);
  EXPECT_EQ(cut.virtual_nodes.size(), 2U * 4 * 3);  // the far face of each side's copies
}

/// Cubes from y = 2 on are cut. What stands on the closed end of the slit shares its nodes.
TEST(LatticeCut, ASlitEndsWhereItsEdgesEnd) {
  const CubeLattice whole = block({5, 5, 2});
  const CubeLattice cut = cut_lattice(whole, plane(0, 2, [](Vec3i p) { return p.y >= 2; }));
  expect_sound(cut, whole);
  EXPECT_EQ(parts(cut), 1);
  // The edges at y = 2 are cut, so cubes from y = 2 up are; the cubes below are not, and close the face y
  // = 2.
  EXPECT_EQ(cut.copies.size(), 2U * 3 * 2);
  EXPECT_EQ(cut.virtual_nodes.size(), 2U * 3 * 3);
}

TEST(LatticeCut, CrossingPlanesMakeFourAndEightParts) {
  const CubeLattice whole = block({5, 5, 5});
  const EdgeIsCut cross = either(plane(0, 2), plane(1, 2));
  const CubeLattice four = cut_lattice(whole, cross), eight = cut_lattice(whole, either(cross, plane(2, 1)));
  expect_sound(four, whole);
  expect_sound(eight, whole);
  EXPECT_EQ(parts(four), 4);
  EXPECT_EQ(parts(eight), 8);
  EXPECT_EQ(eight.copies.size(), 3U * 16 * 2 + 3U * 4 * 4 + 8);
}

/// Whatever edges are cut: regular nodes that uncut edges join stay joined, in one part.
TEST(LatticeCut, RandomEdgesKeepWhatTheyDoNotCut) {
  const CubeLattice whole = block({4, 4, 4});
  for (unsigned seed = 0; seed < 50; ++seed) {
    std::mt19937 random(seed);
    std::map<std::array<Index, 4>, bool> chosen;
    const double share = 0.1 + 0.015 * seed;
    const CubeLattice cut = cut_lattice(whole, [&](Vec3i p, int axis) {
      const auto [edge, is_new] = chosen.try_emplace({p.x, p.y, p.z, axis}, false);
      if (is_new) edge->second = std::uniform_real_distribution<>(0, 1)(random) < share;
      return edge->second;
    });
    expect_sound(cut, whole);
    for (std::size_t k = 0; k < cut.copies.size(); ++k) {
      const auto& nodes = cut.cube_nodes[at(cut.regular_cubes()) + k];
      EXPECT_EQ(std::set<Index>(nodes.begin(), nodes.end()).size(), 8U);
    }
  }
}

TEST(LatticeCut, CapacityIsNoMaterial) {
  const CubeLattice whole = block({5, 3, 2});
  const CubeLattice cut = cut_lattice(whole, plane(0, 2), {.copies = 40, .nodes = 50});
  expect_sound(cut_lattice(whole, plane(0, 2)), whole);
  EXPECT_EQ(cut.copies.size(), 40U);
  EXPECT_EQ(cut.virtual_nodes.size(), 50U);
  EXPECT_NEAR(cut.mass_kg(), whole.mass_kg(), 1e-6 * whole.mass_kg());
  EXPECT_FALSE(cut.has_cube(at(cut.cube_count() - 1)));
  EXPECT_EQ(cut.fixed.back(), kAllAxes);
  EXPECT_EQ(cut.node_mass_kg.back(), 0.F);
  EXPECT_EQ(with_copies(cut, std::vector<std::uint8_t>(whole.cubes.size(), 3)).size(), cut.cubes.size());
  EXPECT_THROW(cut_lattice(cut, plane(1, 1)), std::exception);
}

}  // namespace
}  // namespace tactus
