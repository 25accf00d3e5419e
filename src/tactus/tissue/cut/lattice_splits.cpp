// Which cubes fall apart, and which nodes their parts have.
#include <algorithm>
#include <bit>
#include <utility>

#include "tactus/base/at.h"
#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus::cut {
namespace {

/// Eight cubes, in 16 parts each.
constexpr std::size_t kMostAtCorner = 128;

Vec3i step(int q) { return {q & 1, q >> 1 & 1, q >> 2}; }

/// Corners that a cube owns, as bits of the 3^3 lattice points round the one that is its corner q.
std::uint32_t points_round(int q, std::uint8_t own) {
  const std::uint32_t bits = own;
  const std::uint32_t from_low = (bits & 3U) | (bits & 12U) << 1U | (bits & 48U) << 5U | (bits & 192U) << 6U;
  const Vec3i d = step(q);
  return from_low << static_cast<unsigned>(13 - d.x - 3 * d.y - 9 * d.z);
}

/// Sets of cubes and copies that hang together at a lattice corner, by the points that they own. No two sets
/// meet.
class CornerSets {
 public:
  /// @param points that the next one owns @param island of which it is
  void add(std::uint32_t points, Index island) {
    std::uint8_t own = kNone;
    for (std::uint8_t s = 0; s < sets_; ++s) {
      if ((points_of_[s] & points) == 0 || island_of_[s] != island) continue;
      if (own == kNone) {
        own = s;
        continue;
      }
      points_of_[own] |= std::exchange(points_of_[s], 0);
      std::replace(set_.begin(), set_.begin() + count_, s, own);
    }
    if (own == kNone) {
      points_of_[own = sets_++] = 0;
      island_of_[own] = island;
    }
    points_of_[own] |= points;
    set_[count_++] = own;
  }
  std::size_t operator[](std::size_t k) const { return set_[k]; }

 private:
  static constexpr std::uint8_t kNone = 255;
  std::array<std::uint32_t, kMostAtCorner> points_of_;  ///< per set; 0: it was joined to another one
  std::array<Index, kMostAtCorner> island_of_;          ///< per set
  std::array<std::uint8_t, kMostAtCorner> set_;
  std::uint8_t sets_ = 0, count_ = 0;
};

}  // namespace

LatticeCutter::Parts LatticeCutter::components(Index cube, std::uint32_t cut_edges) const {
  const std::uint8_t own = corners(cube);
  unsigned of[8];
  for (unsigned q = 0; q < 8; ++q) of[q] = own & 1U << q;
  for (unsigned e = 0; e < pairs_of(cube); ++e) {
    const auto [a, b] = kCornerPairs[e];
    if ((own >> a & own >> b & 1) == 0 || (cut_edges >> e & 1U) != 0) continue;
    const unsigned both = of[a] | of[b];
    for (unsigned& set : of)
      if ((set & both) != 0) set = both;
  }
  Parts found;
  for (int q = 0; q < 8; ++q)
    if (of[q] != 0 && std::countr_zero(of[q]) == q)
      found.corners[at(found.count++)] = static_cast<std::uint8_t>(of[q]);
  return found;
}

/// Walls go on through the part of a cube where it has no material, so they reach the surface of its
/// material. There they follow the strip as far as that goes.
std::uint8_t LatticeCutter::extended(std::uint32_t cut_edges, std::uint8_t low, std::uint8_t high) {
  unsigned side[2] = {low, high};
  for (const bool across : {false, true}) {
    for (bool changes = true; changes;) {
      changes = false;
      for (int e = 0; e < 12; ++e) {
        const auto [a, b] = kCornerPairs[at(e)];
        if (!across && (cut_edges >> e & 1U) != 0) continue;
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
  island_[at(copy)] = island_[at(parent)];
  lattice_.copies[at(copy - lattice_.regular_cubes())] = {regular_of(parent), own};
  lattice_.cubes[at(copy)] = lattice_.cubes[at(parent)];
  lattice_.cube_nodes[at(copy)] = lattice_.cube_nodes[at(parent)];
}

/// Whether there is capacity for the nodes of new copies, which are in place then.
bool LatticeCutter::fits() {
  Index copy = next_copy_, nodes = next_node_;
  before_.clear();
  const Vec3i n = lattice_.node_dims;
  for (const auto& [cube, parts] : falling_) {
    replace_live(cube, copy, parts);
    copy += 2 * (parts - 1);
    for (int q = 0; q < 8; ++q) {
      const Vec3i p = lattice_.cubes[at(cube)] + step(q);
      touched_.insert((p.z * n.y + p.y) * n.x + p.x);
    }
  }
  find_affected();
  cpu_for(affected_.size(), 32, [&](std::size_t k) { share_nodes(affected_[k]); });
  for (const SharedNodes& shared : affected_) nodes += shared.new_nodes;
  if (nodes <= lattice_.node_count()) return true;
  for (auto known = before_.rbegin(); known != before_.rend(); ++known)
    live_[at(known->first)] = known->second;
  affected_.clear();
  return false;
}

/// Corners that touched_ has, with places for their entries.
void LatticeCutter::find_affected() {
  touched_.take(found_);
  affected_.clear();
  std::size_t count = 0;
  const Vec3i n = lattice_.node_dims;
  for (const Index p : found_) {
    SharedNodes& shared = affected_.emplace_back();
    shared.corner = {p % n.x, p / n.x % n.y, p / n.x / n.y};
    shared.first = count;
    for (int q = 0; q < 8; ++q)
      if (const Index regular = regular_at(shared.corner - step(q)); regular >= 0)
        shared.count += live(regular).size();
    count += shared.count;
  }
  at_corners_.resize(count);
}

/// @param first_copy of those that add_splits() made of `count` parts
void LatticeCutter::replace_live(Index cube, Index first_copy, Index count) {
  const Index regular = regular_of(cube);
  Index& place = cut_place_[at(regular)];
  if (place < 0) {
    place = static_cast<Index>(live_.size());
    live_.push_back({{regular}, 1});
  }
  Live& live = live_[at(place)];
  before_.emplace_back(place, live);
  const auto end = live.cubes.begin() + live.count;
  live.count = static_cast<Index>(std::remove(live.cubes.begin(), end, cube) - live.cubes.begin());
  for (Index k = 0; k + 1 < count; ++k) live.cubes[at(live.count++)] = first_copy + 2 * k;
  live.cubes[at(live.count++)] = first_copy + 2 * count - 3;
}

std::span<const std::vector<CubeSplit>> LatticeCutter::splits(
    const std::function<bool(Index)>& has_capacity) {
  std::sort(dirty_.begin(), dirty_.end());
  dirty_.erase(std::unique(dirty_.begin(), dirty_.end()), dirty_.end());
  falling_.clear();
  for (auto& stage : stages_) stage.clear();
  stage_count_ = 0;
  Index next = next_copy_;
  is_full_ = false;
  dirty_cubes_.resize(dirty_.size());
  cpu_for(dirty_.size(), 32, [&](std::size_t k) {
    DirtyCube& found = dirty_cubes_[k];
    found = {};
    if (!(lattice_.cube_fill[at(dirty_[k])] > 0)) return;
    found.cut_edges = cut_edges(dirty_[k]);
    found.parts = components(dirty_[k], found.cut_edges);
  });
  for (std::size_t k = 0; k < dirty_.size(); ++k) {
    const Index cube = dirty_[k];
    const auto& [edges, parts] = dirty_cubes_[k];
    const Index n = parts.count;
    is_full_ = is_full_ || (n > 1 && next + 2 * (n - 1) > lattice_.cube_count());
    if (n < 2 || is_full_) continue;
    add_splits(cube, edges, parts, next);
    falling_.push_back({cube, n});
    next += 2 * (n - 1);
  }
  affected_.clear();
  is_full_ = is_full_ || (has_capacity && !has_capacity(next - next_copy_)) || !fits();
  if (is_full_) {
    for (Index copy = next_copy_; copy < next; ++copy)
      lattice_.copies[at(copy - lattice_.regular_cubes())] = {};
    return {};
  }
  dirty_.clear();
  next_copy_ = next;
  return std::span(stages_).first(stage_count_);
}

std::span<const std::vector<CubeSplit>> LatticeCutter::part_island(std::span<const Index> cubes,
                                                                   std::span<const std::uint8_t> is_whole) {
  falling_.clear();
  for (auto& stage : stages_) stage.clear();
  affected_.clear();
  Index next = next_copy_;
  // As many parts as that a cube may have in the end.
  const auto has_capacity = [&](Index cube) {
    int parts = std::popcount(static_cast<unsigned>(corners(cube)));
    for (const Index other : live(regular_of(cube)))
      parts += std::popcount(static_cast<unsigned>(corners(other)));
    return at(parts) <= kMostLive;
  };
  const bool has_copies = next + 2 * static_cast<Index>(cubes.size()) <= lattice_.cube_count();
  has_left_islands_ = has_left_islands_ || !has_copies;
  is_full_ = !has_copies || !std::all_of(cubes.begin(), cubes.end(), has_capacity);
  if (is_full_) return {};
  ++islands_;
  for (std::size_t k = 0; k < cubes.size(); ++k) {
    CubeSplit split{.parent = cubes[k], .part = {next, next + 1}};
    add_copy(split, 0, is_whole[k] != 0 ? std::uint8_t{0} : corners(cubes[k]));
    add_copy(split, 1, corners(cubes[k]));
    island_[at(next + 1)] = islands_;
    stages_[0].push_back(split);
    falling_.push_back({cubes[k], 2});
    next += 2;
  }
  is_full_ = !fits();
  has_left_islands_ = has_left_islands_ || is_full_;
  if (is_full_) {
    for (Index copy = next_copy_; copy < next; ++copy)
      lattice_.copies[at(copy - lattice_.regular_cubes())] = {};
    return {};
  }
  next_copy_ = next;
  stage_count_ = 1;
  return std::span(stages_).first(1);
}

/// Cuts between nodes that a copy had at its corners are between those that it has now, which blades find
/// where they found the old ones.
void LatticeCutter::copy_cuts(Index cube, const std::array<Index, 8>& before) {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  for (std::size_t e = 0; e < kPairs; ++e) {
    const auto [a, b] = kCornerPairs[e];
    const Index old_a = before[at(a)], old_b = before[at(b)], new_a = nodes[at(a)], new_b = nodes[at(b)];
    const bool is_own = (corners(cube) >> a & corners(cube) >> b & 1) != 0;
    if (!is_own || (old_a == new_a && old_b == new_b)) continue;
    const float* known = cuts_.find(key(old_a, old_b));
    if (known == nullptr) continue;
    const float place = (old_a < old_b) == (new_a < new_b) ? *known : 1 - *known;
    cuts_.try_emplace(key(new_a, new_b), place);
  }
  for (std::size_t q = 0; q < 8; ++q) {
    if ((corners(cube) >> q & 1) == 0 || kept_off_[at(before[q])] == Vec3f{} ||
        kept_off_[at(nodes[q])] != Vec3f{})
      continue;
    kept_off_[at(nodes[q])] = kept_off_[at(before[q])];
    near_wall_.push_back(nodes[q]);
  }
}

/// The rest of a cube while its parts are split off has a copy, too.
void LatticeCutter::add_splits(Index cube, std::uint32_t cut_edges, const Parts& parts, Index first) {
  std::uint8_t rest = corners(cube);
  Index parent = cube;
  for (Index k = 0; k + 1 < parts.count; ++k) {
    const std::uint8_t own = parts.corners[at(k)];
    rest = static_cast<std::uint8_t>(rest & ~own);
    CubeSplit split{.parent = parent, .part = {first, first + 1}};
    split.sides = extended(cut_edges, own, rest);
    add_copy(split, 0, own);
    add_copy(split, 1, rest);
    stage_count_ = std::max(stage_count_, at(k) + 1);
    if (stage_count_ > stages_.size()) stages_.resize(stage_count_);
    stages_[at(k)].push_back(split);
    parent = first + 1;
    first += 2;
  }
}

/// Cubes and copies at a lattice corner share nodes as far as they own lattice points together: the corner,
/// or others of the faces and edges that they share there. The regular node is with the corner's material; a
/// set keeps the virtual node that it had.
void LatticeCutter::share_nodes(SharedNodes& shared) {
  const std::span<AtCorner> entries = this->entries(shared);
  CornerSets set;
  std::size_t count = 0;
  for (int q = 0; q < 8; ++q) {
    const Index regular = regular_at(shared.corner - step(q));
    if (regular < 0) continue;
    for (const Index cube : live(regular)) {
      const std::uint8_t own = corners(cube);
      // The regular node is not an island's.
      const Index island = island_[at(cube)];
      entries[count++] = {cube, static_cast<std::uint8_t>(q), (own >> q & 1) != 0 && island == 0, -1,
                          lattice_.cube_nodes[at(cube)][at(q)]};
      set.add(points_round(q, own), island);
    }
  }
  std::array<Index, kMostAtCorner> node, taken;  // per set; of virtual nodes
  std::fill_n(node.begin(), count, -1);
  std::size_t taken_count = 0;
  const auto take = [&](std::size_t e) {
    const Index old = entries[e].before;
    const auto end = taken.begin() + static_cast<std::ptrdiff_t>(taken_count);
    if (node[set[e]] >= 0 || old < lattice_.regular_nodes() || std::find(taken.begin(), end, old) != end)
      return;
    taken[taken_count++] = node[set[e]] = old;
  };
  for (std::size_t e = 0; e < count; ++e)
    if (entries[e].owns_corner) node[set[e]] = entries[e].before;
  for (std::size_t e = 0; e < count; ++e)
    if ((corners(entries[e].cube) >> entries[e].corner & 1) != 0) take(e);
  for (std::size_t e = 0; e < count; ++e) take(e);
  shared.new_nodes = 0;
  for (std::size_t e = 0; e < count; ++e) {
    Index& of = node[set[e]];
    if (corners(entries[e].cube) == 0) {  // nothing is in it
      entries[e].node = entries[e].before;
      continue;
    }
    if (of < 0) of = next_node_ + shared.new_nodes++;
    entries[e].node = of;
  }
}

/// New nodes are in the list already, in ascending order.
void LatticeCutter::share_masses(Index first_new, TopologyChange& change) {
  std::array<std::pair<Index, float>, kMostAtCorner> mass_kg;
  for (const SharedNodes& shared : affected_) {
    std::size_t count = 0;
    for (const AtCorner& e : entries(shared)) {
      std::size_t k = 0;
      while (k < count && mass_kg[k].first != e.node) ++k;
      if (k == count) mass_kg[count++] = {e.node, 0.F};
      mass_kg[k].second += lattice_.share_of(e.cube, e.corner) * lattice_.cube_mass_kg[at(e.cube)];
    }
    for (const auto& [node, mass] : std::span(mass_kg).first(count)) {
      lattice_.node_mass_kg[at(node)] = mass;
      const HeldAxes fixed = held_axes(lattice_, node);
      if (node >= first_new) {
        change.nodes[at(node - first_new)].mass_kg = mass;
        change.nodes[at(node - first_new)].fixed = fixed;
      } else {
        change.nodes.push_back(
            {.node = node, .from = -1, .layer = shared.corner.z, .mass_kg = mass, .fixed = fixed});
      }
    }
  }
}

/// Lists the copies that are new or have other nodes.
void LatticeCutter::add_copies(Index first_copy, TopologyChange& change) {
  touched_.take(found_);
  for (const Index cube : found_) {
    if (!(lattice_.cube_fill[at(cube)] > 0)) continue;  // it fell apart in the next stage
    change.copies.push_back({cube, lattice_.copies[at(cube - lattice_.regular_cubes())],
                             cube < first_copy ? cube : root_[at(cube - first_copy)],
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
      if (lattice_.cube_fill[at(split.part[part])] > 0) continue;
      // Nothing is in it, so it is none of those that have the cube's material.
      remove_live(split.part[part]);
    }
  }
}

/// Copies at affected corners get the nodes that share_nodes() found.
void LatticeCutter::take_nodes(TopologyChange& change) {
  const Index first_new = next_node_;
  for (const SharedNodes& shared : affected_) {
    for (AtCorner& e : entries(shared)) {
      const bool is_new = e.node >= first_new;
      if (is_new) e.node += next_node_ - first_new;
      if (e.node == e.before) continue;
      if (is_new) add_node(e.node, e.before, change);
      lattice_.cube_nodes[at(e.cube)][at(e.corner)] = e.node;
      touched_.insert(e.cube);
    }
    next_node_ += shared.new_nodes;
  }
}

void LatticeCutter::remove_live(Index copy) {
  Live& live = live_[at(cut_place_[at(regular_of(copy))])];
  const auto end = live.cubes.begin() + live.count;
  live.count = static_cast<Index>(std::remove(live.cubes.begin(), end, copy) - live.cubes.begin());
}

/// The joined part was one of its own, so others share the nodes that they shared.
void LatticeCutter::join(std::span<const std::array<Index, 2>> from_to, TopologyChange& change) {
  change.clear();
  if (from_to.empty()) return;
  const Vec3i n = lattice_.node_dims;
  for (const auto& [from, to] : from_to) {
    lattice_.cube_fill[at(to)] += std::exchange(lattice_.cube_fill[at(from)], 0.F);
    lattice_.cube_mass_kg[at(to)] += std::exchange(lattice_.cube_mass_kg[at(from)], 0.F);
    remove_live(from);
    change.cut.push_back({from, lattice_.cubes[at(from)].z});
    for (int q = 0; q < 8; ++q) {
      const Vec3i p = lattice_.cubes[at(from)] + step(q);
      touched_.insert((p.z * n.y + p.y) * n.x + p.x);
      lattice_.node_mass_kg[at(lattice_.cube_nodes[at(from)][at(q)])] = 0;
    }
  }
  find_affected();
  Index new_nodes = 0;
  for (SharedNodes& shared : affected_) {
    share_nodes(shared);
    new_nodes += shared.new_nodes;
  }
  const Index first_new = next_node_;
  if (first_new + new_nodes <= lattice_.node_count()) take_nodes(change);
  for (const auto& [from, to] : from_to) touched_.insert(to);
  add_copies(next_copy_, change);
  share_masses(first_new, change);
  for (const auto& [from, to] : from_to)
    for (const Index node : lattice_.cube_nodes[at(from)]) {
      const bool is_told = std::any_of(change.nodes.begin(), change.nodes.end(),
                                       [&](const TopologyChange::Node& known) { return known.node == node; });
      if (!is_told)
        change.nodes.push_back({.node = node,
                                .from = -1,
                                .layer = lattice_.nodes[at(node)].z,
                                .mass_kg = 0,
                                .fixed = held_axes(lattice_, node)});
    }
}

void LatticeCutter::commit(std::span<const std::vector<CubeSplit>> stages, TopologyChange& change) {
  change.clear();
  if (stages.empty()) return;
  const Index first_copy = stages.front().front().part[0];
  root_.resize(at(next_copy_ - first_copy));  // per new copy: the cube that was there before
  for (const std::vector<CubeSplit>& stage : stages) {
    for (const CubeSplit& split : stage) {
      const bool is_new = split.parent >= first_copy;
      const Index parent = is_new ? root_[at(split.parent - first_copy)] : split.parent;
      if (!is_new) change.cut.push_back({parent, lattice_.cubes[at(parent)].z});
      for (const Index part : split.part) {
        root_[at(part - first_copy)] = parent;
        touched_.insert(part);
      }
    }
  }
  const Index first_new = next_node_;
  std::vector<std::pair<Index, std::array<Index, 8>>> islands;
  for (const std::vector<CubeSplit>& stage : stages)
    for (const CubeSplit& split : stage)
      if (island_[at(split.part[1])] != 0)
        for (const Index part : split.part) islands.emplace_back(part, lattice_.cube_nodes[at(part)]);
  take_nodes(change);
  for (const auto& [cube, before] : islands) copy_cuts(cube, before);
  add_copies(first_copy, change);
  share_masses(first_new, change);
}

/// @param old node at the same place, of which it is a twin
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
