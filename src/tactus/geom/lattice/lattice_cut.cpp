#include "tactus/geom/lattice/lattice_cut.h"

#include <algorithm>
#include <bit>
#include <map>
#include <numeric>

#include "tactus/base/at.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

Vec3i corner_of(Vec3i cube, int q) { return cube + Vec3i{q & 1, q >> 1 & 1, q >> 2}; }

/// Sets that are joined; each is named by its lowest member.
class DisjointSets {
 public:
  Index add() {
    parent_.push_back(static_cast<Index>(parent_.size()));
    return parent_.back();
  }
  Index find(Index i) {
    while (parent_[at(i)] != i) i = parent_[at(i)] = parent_[at(parent_[at(i)])];
    return i;
  }
  void join(Index a, Index b) {
    const Index of_a = find(a), of_b = find(b);
    parent_[at(std::max(of_a, of_b))] = std::min(of_a, of_b);
  }

 private:
  std::vector<Index> parent_;
};

/// Components of a cube's corners that uncut edges join, as bits, ascending by their lowest corner.
std::vector<std::uint8_t> components(Vec3i cube, const EdgeIsCut& is_cut) {
  unsigned of[8];
  for (unsigned q = 0; q < 8; ++q) of[q] = 1U << q;
  for (int axis = 0; axis < 3; ++axis) {
    for (int q = 0; q < 8; ++q) {
      const int other = q | 1 << axis;
      if (other == q || is_cut(corner_of(cube, q), axis)) continue;
      const unsigned both = of[q] | of[other];
      for (int c = 0; c < 8; ++c)
        if ((both >> c & 1U) != 0) of[c] = both;
    }
  }
  std::vector<std::uint8_t> found;
  for (int q = 0; q < 8; ++q)
    if (std::countr_zero(of[q]) == q) found.push_back(static_cast<std::uint8_t>(of[q]));
  return found;
}

/// Faces and edges of cubes, and the cubes that have them. Corners of a face: at, and one or two steps away.
struct Side {
  Index cube = 0;  ///< of cubes and copies
  int corner[4] = {};
  int corners = 0;
};
using Sides = std::map<std::array<Index, 4>, std::vector<Side>>;

void add_sides(Sides& sides, Index cube, const std::array<Index, 8>& regular) {
  const auto add = [&](int q, std::initializer_list<int> steps) {
    Side side{.cube = cube};
    std::array<Index, 4> key{-1, -1, -1, -1};
    for (const int step : steps) {
      side.corner[side.corners] = q | step;
      key[at(side.corners++)] = regular[at(q | step)];
    }
    sides[key].push_back(side);
  };
  for (int q = 0; q < 8; ++q) {
    for (int a = 0; a < 3; ++a) {
      const int one = 1 << a, two = 1 << (a + 1) % 3;
      if ((q & one) != 0) continue;
      add(q, {0, one});
      if ((q & two) == 0) add(q, {0, one, two, one | two});
    }
  }
}

/// The nodes of copies while they are joined. Regular nodes are their own first members.
class CopyNodes {
 public:
  explicit CopyNodes(const CubeLattice& whole) : whole_(whole) {
    for (Index i = 0; i < whole.node_count(); ++i) sets_.add();
  }
  void add(Index cube, std::uint8_t corners) {
    std::array<Index, 8> node = whole_.cube_nodes[at(cube)];
    for (std::size_t q = 0; q < 8; ++q)
      if ((corners >> q & 1U) == 0) node[q] = sets_.add();
    entries_.push_back({cube, corners, node});
  }
  /// Joins the nodes of shared faces and edges.
  void join() {
    Sides sides;
    for (std::size_t e = 0; e < entries_.size(); ++e)
      add_sides(sides, static_cast<Index>(e), whole_.cube_nodes[at(entries_[e].cube)]);
    for (const auto& [key, owners] : sides)
      for (std::size_t a = 0; a < owners.size(); ++a)
        for (std::size_t b = a + 1; b < owners.size(); ++b) join(owners[a], owners[b]);
  }
  /// The set of corner q of an entry.
  Index find(std::size_t entry, std::size_t q) { return sets_.find(entries_[entry].node[q]); }

 private:
  struct Entry {
    Index cube;
    std::uint8_t corners;
    std::array<Index, 8> node;
  };
  void join(const Side& a, const Side& b) {
    const Entry &of_a = entries_[at(a.cube)], &of_b = entries_[at(b.cube)];
    bool shares = false;
    for (int k = 0; k < a.corners; ++k)
      shares = shares || ((of_a.corners >> a.corner[k] & of_b.corners >> b.corner[k] & 1U) != 0);
    for (int k = 0; shares && k < a.corners; ++k)
      sets_.join(of_a.node[at(a.corner[k])], of_b.node[at(b.corner[k])]);
  }
  const CubeLattice& whole_;
  DisjointSets sets_;
  std::vector<Entry> entries_;
};

void add_copy(CubeLattice& lattice, CubeCopy copy) {
  const std::size_t cube = at(copy.of);
  const float share = static_cast<float>(std::popcount(copy.corners)) / 8;
  lattice.copies.push_back(copy);
  lattice.cubes.push_back(lattice.cubes[cube]);
  lattice.cube_fill.push_back(share * lattice.cube_fill[cube]);
  lattice.cube_mass_kg.push_back(share * lattice.cube_mass_kg[cube]);
}

void add_capacity(CubeLattice& lattice, VirtualCapacity capacity) {
  while (static_cast<Index>(lattice.copies.size()) < capacity.copies) {
    lattice.copies.push_back({});
    lattice.cubes.push_back(lattice.cubes[0]);
    lattice.cube_nodes.push_back(lattice.cube_nodes[0]);
    lattice.cube_fill.push_back(0);
    lattice.cube_mass_kg.push_back(0);
  }
  while (static_cast<Index>(lattice.virtual_nodes.size()) < capacity.nodes) {
    lattice.virtual_nodes.push_back(-1);
    lattice.nodes.push_back(lattice.nodes[0]);
    lattice.fixed.push_back(kAllAxes);
  }
}

}  // namespace

CubeLattice cut_lattice(const CubeLattice& whole, const EdgeIsCut& is_cut, VirtualCapacity capacity) {
  if (!whole.copies.empty() || !whole.virtual_nodes.empty())
    throw Error("the lattice is cut already, or has capacity for a cut: cut it once, by all edges");
  CubeLattice lattice = whole;
  if (lattice.cube_fill.empty()) lattice.cube_fill.assign(lattice.cubes.size(), 1);
  CopyNodes nodes(whole);
  std::vector<Index> uncut;
  std::vector<std::uint8_t> near_cut(whole.nodes.size());
  for (Index c = 0; c < whole.cube_count(); ++c) {
    const std::vector<std::uint8_t> parts = components(whole.cubes[at(c)], is_cut);
    if (parts.size() == 1) {
      uncut.push_back(c);
      continue;
    }
    for (const std::uint8_t corners : parts) {
      nodes.add(c, corners);
      add_copy(lattice, {c, corners});
    }
    for (const Index node : whole.cube_nodes[at(c)]) near_cut[at(node)] = 1;
    lattice.cube_fill[at(c)] = lattice.cube_mass_kg[at(c)] = 0;
  }
  for (const Index c : uncut) {
    const auto& corners = whole.cube_nodes[at(c)];
    if (std::any_of(corners.begin(), corners.end(), [&](Index i) { return near_cut[at(i)] != 0; }))
      nodes.add(c, 0xFF);
  }
  nodes.join();
  std::map<Index, Index> id;  // of a set that holds no regular node
  for (std::size_t e = 0; e < lattice.copies.size(); ++e) {
    std::array<Index, 8> corners{};
    for (std::size_t q = 0; q < 8; ++q) {
      corners[q] = nodes.find(e, q);
      if (corners[q] < whole.node_count()) continue;
      const auto [known, is_new] = id.try_emplace(corners[q], lattice.node_count());
      corners[q] = known->second;
      if (!is_new) continue;
      const Index regular = whole.cube_nodes[at(lattice.copies[e].of)][q];
      lattice.virtual_nodes.push_back(regular);
      lattice.nodes.push_back(whole.nodes[at(regular)]);
      lattice.fixed.push_back(whole.fixed[at(regular)]);
    }
    lattice.cube_nodes.push_back(corners);
  }
  add_capacity(lattice, capacity);
  lattice.share_masses();
  return lattice;
}

Index nodes_in_use(const CubeLattice& lattice) {
  Index used = lattice.node_count();
  for (auto from = lattice.virtual_nodes.rbegin(); from != lattice.virtual_nodes.rend() && *from < 0; ++from)
    --used;
  return used;
}

}  // namespace tactus
