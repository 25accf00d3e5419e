// Which cubes fall apart, and which nodes their parts have.
#include <algorithm>
#include <bit>
#include <numeric>

#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus::cut {
namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

Vec3i step(int q) { return {q & 1, q >> 1 & 1, q >> 2}; }

/// Lowest index of the set that i belongs to.
int find(std::array<int, 64>& parent, int i) {
  while (parent[at(i)] != i) i = parent[at(i)];
  return i;
}

/// Per way from one cube to a neighbour that it shares a face or an edge with (9 z + 3 y + x + 13) and the
/// neighbour's corners: which of the first one's those are.
using CornersOfNeighbours = std::array<std::array<std::uint8_t, 256>, 27>;
CornersOfNeighbours corners_of_neighbours() {
  CornersOfNeighbours table{};
  for (int k = 0; k < 27; ++k) {
    const Vec3i d{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1};
    const int apart = (d.x != 0 ? 1 : 0) + (d.y != 0 ? 1 : 0) + (d.z != 0 ? 1 : 0);
    if (apart == 0 || apart == 3) continue;
    for (unsigned own = 0; own < 256; ++own)
      for (int q = 0; q < 8; ++q) {
        const Vec3i in_b = step(q) - d;
        if (min(in_b.x, min(in_b.y, in_b.z)) < 0 || max(in_b.x, max(in_b.y, in_b.z)) > 1) continue;
        const int r = in_b.x | in_b.y << 1 | in_b.z << 2;
        if ((own >> r & 1U) != 0) table[at(k)][own] |= static_cast<std::uint8_t>(1U << q);
      }
  }
  return table;
}

/// Whether two cubes share the node at a lattice corner that both have, by what they have of the faces and
/// edges that they share there.
bool joined(Vec3i cube_a, std::uint8_t own_a, Vec3i cube_b, std::uint8_t own_b) {
  static const CornersOfNeighbours of_neighbours = corners_of_neighbours();
  const Vec3i d = cube_b - cube_a;
  return (own_a & of_neighbours[at(9 * d.z + 3 * d.y + d.x + 13)][own_b]) != 0;
}

}  // namespace

std::vector<std::uint8_t> LatticeCutter::components(Index cube) const {
  const std::uint8_t own = corners(cube);
  unsigned of[8];
  for (unsigned q = 0; q < 8; ++q) of[q] = own & 1U << q;
  for (int e = 0; e < 12; ++e) {
    const auto [a, b] = kCornerPairs[at(e)];
    if ((own >> a & own >> b & 1) == 0 || is_cut(cube, a, b)) continue;
    const unsigned both = of[a] | of[b];
    for (unsigned& set : of)
      if ((set & both) != 0) set = both;
  }
  std::vector<std::uint8_t> found;
  for (int q = 0; q < 8; ++q)
    if (of[q] != 0 && std::countr_zero(of[q]) == q) found.push_back(static_cast<std::uint8_t>(of[q]));
  return found;
}

/// Walls go on through the part of a cube where it has no material, so they reach the surface of what it has.
/// There they follow the strip as far as that goes.
std::uint8_t LatticeCutter::extended(Index cube, std::uint8_t low, std::uint8_t high) const {
  unsigned side[2] = {low, high};
  for (const bool across : {false, true}) {
    for (bool changes = true; changes;) {
      changes = false;
      for (int e = 0; e < 12; ++e) {
        const auto [a, b] = kCornerPairs[at(e)];
        if (!across && is_cut(cube, a, b)) continue;
        const unsigned known = side[0] | side[1];
        if ((known >> a & 1U) == (known >> b & 1U)) continue;
        const int from = (known >> a & 1U) != 0 ? a : b, to = from == a ? b : a;
        side[side[1] >> from & 1U] |= 1U << to;
        changes = true;
      }
    }
  }
  return static_cast<std::uint8_t>(side[1]);
}

void LatticeCutter::add_copy(const CubeSplit& split, int part, std::uint8_t own) {
  const Index copy = split.part[part], parent = split.parent;
  lattice_.copies[at(copy - lattice_.regular_cubes())] = {regular_of(parent), own};
  lattice_.cubes[at(copy)] = lattice_.cubes[at(parent)];
  lattice_.cube_nodes[at(copy)] = lattice_.cube_nodes[at(parent)];
}

/// Whether there is room for the nodes of new copies, which are in place then.
bool LatticeCutter::fits(const std::vector<Index>& cubes, const std::vector<Index>& parts) {
  Index copy = next_copy_, nodes = next_node_;
  std::vector<std::pair<Index, std::vector<Index>>> before;
  const Vec3i n = lattice_.node_dims;
  for (std::size_t k = 0; k < cubes.size(); ++k) {
    const Index regular = regular_of(cubes[k]);
    const std::span<const Index> now = live(regular);
    before.emplace_back(regular, std::vector<Index>(now.begin(), now.end()));
    replace_live(cubes[k], copy, parts[k]);
    copy += 2 * (parts[k] - 1);
    for (int q = 0; q < 8; ++q) {
      const Vec3i p = lattice_.cubes[at(regular)] + step(q);
      touched_.insert((p.z * n.y + p.y) * n.x + p.x);
    }
  }
  std::vector<Index> corners;
  touched_.take(corners);
  affected_.clear();
  for (const Index p : corners) affected_.push_back({p % n.x, p / n.x % n.y, p / n.x / n.y});
  if (shared_.size() < affected_.size()) shared_.resize(affected_.size());
  cpu_for(affected_.size(), 8, [&](std::size_t k) { share_nodes(affected_[k], shared_[k]); });
  for (std::size_t k = 0; k < affected_.size(); ++k) nodes += shared_[k].new_nodes;
  if (nodes <= lattice_.node_count()) return true;
  for (auto known = before.rbegin(); known != before.rend(); ++known)
    live_[at(cut_place_[at(known->first)])] = std::move(known->second);
  affected_.clear();
  return false;
}

/// @param first_copy of those that add_splits() made of `count` parts
void LatticeCutter::replace_live(Index cube, Index first_copy, Index count) {
  const Index regular = regular_of(cube);
  Index& place = cut_place_[at(regular)];
  if (place < 0) {
    place = static_cast<Index>(live_.size());
    live_.push_back({regular});
  }
  std::vector<Index>& cubes = live_[at(place)];
  std::erase(cubes, cube);
  for (Index k = 0; k + 1 < count; ++k) cubes.push_back(first_copy + 2 * k);
  cubes.push_back(first_copy + 2 * count - 3);
}

std::vector<std::vector<CubeSplit>> LatticeCutter::splits(const std::function<bool(Index)>& has_room) {
  std::sort(dirty_.begin(), dirty_.end());
  dirty_.erase(std::unique(dirty_.begin(), dirty_.end()), dirty_.end());
  std::vector<Index> cubes, counts;
  std::vector<std::vector<CubeSplit>> stages;
  Index next = next_copy_;
  is_full_ = false;
  for (const Index cube : dirty_) {
    if (!(lattice_.cube_fill[at(cube)] > 0)) continue;
    const std::vector<std::uint8_t> parts = components(cube);
    const auto n = static_cast<Index>(parts.size());
    is_full_ = is_full_ || (n > 1 && next + 2 * (n - 1) > lattice_.cube_count());
    if (n < 2 || is_full_) continue;
    add_splits(cube, parts, next, stages);
    cubes.push_back(cube);
    counts.push_back(n);
    next += 2 * (n - 1);
  }
  affected_.clear();
  is_full_ = is_full_ || (has_room && !has_room(next - next_copy_)) || !fits(cubes, counts);
  if (is_full_) {
    for (Index copy = next_copy_; copy < next; ++copy)
      lattice_.copies[at(copy - lattice_.regular_cubes())] = {};
    return {};
  }
  dirty_.clear();
  next_copy_ = next;
  return stages;
}

/// What is left of a cube while its parts are split off has a copy, too.
void LatticeCutter::add_splits(Index cube, const std::vector<std::uint8_t>& parts, Index first,
                               std::vector<std::vector<CubeSplit>>& stages) {
  std::uint8_t rest = corners(cube);
  Index parent = cube;
  for (std::size_t k = 0; k + 1 < parts.size(); ++k) {
    rest = static_cast<std::uint8_t>(rest & ~parts[k]);
    CubeSplit split{.parent = parent, .part = {first, first + 1}};
    split.sides = extended(cube, parts[k], rest);
    add_copy(split, 0, parts[k]);
    add_copy(split, 1, rest);
    if (k >= stages.size()) stages.emplace_back();
    stages[k].push_back(split);
    parent = first + 1;
    first += 2;
  }
}

/// Who has material or places at a lattice corner shares nodes as far as faces, edges and the corner join
/// them. The regular node is with the corner's material; a set keeps the virtual node that it had.
void LatticeCutter::share_nodes(Vec3i corner, SharedNodes& shared) const {
  auto& entries = shared.entries;
  entries.clear();
  shared.new_nodes = 0;
  for (int q = 0; q < 8; ++q) {
    const Index regular = regular_at(corner - step(q));
    if (regular < 0) continue;
    for (const Index cube : live(regular))
      entries.push_back({cube, q, -1, lattice_.cube_nodes[at(cube)][at(q)], corners(cube)});
  }
  std::array<int, 64> set{};
  std::iota(set.begin(), set.end(), 0);
  const auto has_corner = [](const SharedNodes::Entry& e) { return (e.own >> e.corner & 1) != 0; };
  for (std::size_t a = 0; a < entries.size(); ++a) {
    for (std::size_t b = a + 1; b < entries.size(); ++b) {
      const auto &p = entries[a], &q = entries[b];
      if (!(has_corner(p) && has_corner(q)) &&
          !joined(lattice_.cubes[at(p.cube)], p.own, lattice_.cubes[at(q.cube)], q.own))
        continue;
      const int of_a = find(set, static_cast<int>(a)), of_b = find(set, static_cast<int>(b));
      set[at(std::max(of_a, of_b))] = std::min(of_a, of_b);
    }
  }
  std::array<Index, 64> node{};
  node.fill(-1);
  std::vector<Index> taken;
  for (std::size_t e = 0; e < entries.size(); ++e)
    if (has_corner(entries[e])) node[at(find(set, static_cast<int>(e)))] = entries[e].before;
  for (std::size_t e = 0; e < entries.size(); ++e) {
    const int of = find(set, static_cast<int>(e));
    const Index old = entries[e].before;
    if (node[at(of)] >= 0 || old < lattice_.regular_nodes() ||
        std::find(taken.begin(), taken.end(), old) != taken.end())
      continue;
    taken.push_back(node[at(of)] = old);
  }
  for (std::size_t e = 0; e < entries.size(); ++e) {
    const int of = find(set, static_cast<int>(e));
    if (node[at(of)] < 0) node[at(of)] = next_node_ + shared.new_nodes++;
    entries[e].node = node[at(of)];
  }
}

/// New nodes are in the list already.
void LatticeCutter::share_masses(Index first_new, TopologyChange& change) {
  std::vector<std::size_t> place_of(at(next_node_ - first_new));
  for (std::size_t k = 0; k < change.nodes.size(); ++k) place_of[at(change.nodes[k].node - first_new)] = k;
  std::vector<std::pair<Index, float>> mass_kg;
  for (std::size_t k = 0; k < affected_.size(); ++k) {
    mass_kg.clear();
    for (const auto& e : shared_[k].entries) {
      auto known =
          std::find_if(mass_kg.begin(), mass_kg.end(), [&](const auto& m) { return m.first == e.node; });
      if (known == mass_kg.end()) known = mass_kg.insert(mass_kg.end(), {e.node, 0.F});
      known->second += lattice_.cube_mass_kg[at(e.cube)] / 8;
    }
    for (const auto& [node, mass] : mass_kg) {
      lattice_.node_mass_kg[at(node)] = mass;
      if (node >= first_new)
        change.nodes[place_of[at(node - first_new)]].mass_kg = mass;
      else
        change.nodes.push_back({.node = node,
                                .from = -1,
                                .layer = affected_[k].z,
                                .mass_kg = mass,
                                .fixed = lattice_.fixed[at(node)]});
    }
  }
}

/// Of copies that are new or have other nodes. @param root per new copy: the cube that was there before
void LatticeCutter::add_copies(const std::vector<Index>& root, Index first_copy, TopologyChange& change) {
  std::vector<Index> touched;
  touched_.take(touched);
  for (const Index cube : touched) {
    if (!(lattice_.cube_fill[at(cube)] > 0)) continue;  // it fell apart in the next stage
    change.copies.push_back({cube, lattice_.copies[at(cube - lattice_.regular_cubes())],
                             cube < first_copy ? cube : root[at(cube - first_copy)],
                             lattice_.cubes[at(cube)].z, lattice_.cube_nodes[at(cube)],
                             lattice_.cube_fill[at(cube)], lattice_.cube_mass_kg[at(cube)]});
  }
}

void LatticeCutter::divide(const std::vector<CubeSplit>& stage, const std::vector<double>& share) {
  for (std::size_t k = 0; k < stage.size(); ++k) {
    const CubeSplit& split = stage[k];
    const double fill = double{lattice_.cube_fill[at(split.parent)]},
                 mass_kg = double{lattice_.cube_mass_kg[at(split.parent)]};
    lattice_.cube_fill[at(split.parent)] = lattice_.cube_mass_kg[at(split.parent)] = 0;
    for (const int part : {0, 1}) {
      const double of = part == 1 ? share[k] : 1 - share[k];
      lattice_.cube_fill[at(split.part[part])] = static_cast<float>(of * fill);
      lattice_.cube_mass_kg[at(split.part[part])] = static_cast<float>(of * mass_kg);
    }
  }
}

TopologyChange LatticeCutter::commit(const std::vector<std::vector<CubeSplit>>& stages) {
  TopologyChange change;
  if (stages.empty()) return change;
  const Index first_copy = stages.front().front().part[0];
  std::vector<Index> root(at(next_copy_ - first_copy));
  for (const std::vector<CubeSplit>& stage : stages) {
    for (const CubeSplit& split : stage) {
      const bool is_new = split.parent >= first_copy;
      const Index parent = is_new ? root[at(split.parent - first_copy)] : split.parent;
      if (!is_new) change.cut.push_back({parent, lattice_.cubes[at(parent)].z});
      for (const Index part : split.part) {
        root[at(part - first_copy)] = parent;
        touched_.insert(part);
      }
    }
  }
  const Index first_new = next_node_;
  for (std::size_t k = 0; k < affected_.size(); ++k) {
    for (auto& e : shared_[k].entries) {
      const bool is_new = e.node >= first_new;
      if (is_new) e.node += next_node_ - first_new;
      if (e.node == e.before) continue;
      if (is_new) add_node(e.node, e.before, change);
      lattice_.cube_nodes[at(e.cube)][at(e.corner)] = e.node;
      touched_.insert(e.cube);
    }
    next_node_ += shared_[k].new_nodes;
  }
  add_copies(root, first_copy, change);
  share_masses(first_new, change);
  return change;
}

/// @param old where it is, and what it is a twin of
void LatticeCutter::add_node(Index node, Index old, TopologyChange& change) {
  const Index place = node - lattice_.regular_nodes(), k = old - lattice_.regular_nodes();
  if (lattice_.virtual_nodes[at(place)] >= 0) return;
  lattice_.virtual_nodes[at(place)] = k < 0 ? old : lattice_.virtual_nodes[at(k)];
  lattice_.nodes[at(node)] = lattice_.nodes[at(old)];
  lattice_.fixed[at(node)] = lattice_.fixed[at(old)];
  change.nodes.push_back({.node = node,
                          .from = old,
                          .layer = lattice_.nodes[at(old)].z,
                          .mass_kg = 0,
                          .fixed = lattice_.fixed[at(old)]});
}

}  // namespace tactus::cut
