#include "tactus/tissue/cut/lattice_cutter.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <string>
#include <tuple>

#include "tactus/base/error.h"

namespace tactus::cut {
namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

Vec3i step(int q) { return {q & 1, q >> 1 & 1, q >> 2}; }

/// Walls stay so far from nodes, in spacings.
constexpr double kFromNode = 5e-5;

Box3f box_of(std::span<const Vec3f> points) {
  Box3f box{points.front(), points.front()};
  for (const Vec3f p : points) box = {min(box.min, p), max(box.max, p)};
  return box;
}

bool overlap(const Box3f& a, const Box3f& b) {
  return a.min.x <= b.max.x && a.min.y <= b.max.y && a.min.z <= b.max.z && b.min.x <= a.max.x &&
         b.min.y <= a.max.y && b.min.z <= a.max.z;
}

/// Lowest index of the set that i belongs to.
int find(std::array<int, 64>& parent, int i) {
  while (parent[at(i)] != i) i = parent[at(i)];
  return i;
}

/// Whether two cubes share the node at a lattice corner, by what they have of the faces and edges that they
/// share there.
bool joined(Vec3i cube_a, std::uint8_t own_a, Vec3i cube_b, std::uint8_t own_b) {
  const Vec3i d = cube_b - cube_a;
  const int apart = (d.x != 0 ? 1 : 0) + (d.y != 0 ? 1 : 0) + (d.z != 0 ? 1 : 0);
  if (apart == 0 || apart == 3) return false;
  for (int q = 0; q < 8; ++q) {
    const Vec3i in_b = step(q) - d;
    if (min(in_b.x, min(in_b.y, in_b.z)) < 0 || max(in_b.x, max(in_b.y, in_b.z)) > 1) continue;
    const int r = in_b.x | in_b.y << 1 | in_b.z << 2;
    if ((own_a >> q & own_b >> r & 1) != 0) return true;
  }
  return false;
}

}  // namespace

const std::array<std::array<int, 2>, kPairs> kCornerPairs = {{{0, 1},
                                                              {2, 3},
                                                              {4, 5},
                                                              {6, 7},
                                                              {0, 2},
                                                              {1, 3},
                                                              {4, 6},
                                                              {5, 7},
                                                              {0, 4},
                                                              {1, 5},
                                                              {2, 6},
                                                              {3, 7},
                                                              {0, 3},
                                                              {4, 7},
                                                              {0, 5},
                                                              {2, 7},
                                                              {0, 6},
                                                              {1, 7},
                                                              {0, 7}}};

Box3f BladeStrip::box_m() const {
  const Box3f a = box_of(begin_m), b = box_of(end_m);
  return {min(a.min, b.min), max(a.max, b.max)};
}

double BladeStrip::area_m2() const {
  double area = 0;
  for (const auto& [a, b, c] : triangles())
    area += 0.5 * length(cross(vec_cast<double>(b.x_m - a.x_m), vec_cast<double>(c.x_m - a.x_m)));
  return area;
}

std::vector<std::array<NamedPoint, 3>> BladeStrip::triangles() const {
  const auto named = [&](const std::vector<Vec3f>& of, std::size_t k, int when) {
    return NamedPoint{of[k], -1 - 2 * static_cast<std::int64_t>(k) - when % 2};
  };
  std::vector<std::array<NamedPoint, 3>> found;
  for (std::size_t k = 0; k + 1 < begin_m.size(); ++k) {
    const NamedPoint a = named(begin_m, k, frame), b = named(begin_m, k + 1, frame),
                     c = named(end_m, k + 1, frame + 1), d = named(end_m, k, frame + 1);
    found.push_back({a, b, c});
    found.push_back({a, c, d});
  }
  return found;
}

LatticeCutter::LatticeCutter(CubeLattice lattice, std::vector<std::uint8_t> may_cut)
    : lattice_(std::move(lattice)),
      may_cut_(std::move(may_cut)),
      next_copy_(lattice_.regular_cubes()),
      next_node_(lattice_.regular_nodes()) {
  if (lattice_.cube_fill.empty()) lattice_.cube_fill.assign(lattice_.cubes.size(), 1);
  const Vec3i n = lattice_.node_dims - Vec3i{1, 1, 1};
  grid_.assign(at(std::int64_t{n.x} * n.y * n.z), -1);
  for (Index c = 0; c < lattice_.regular_cubes(); ++c) {
    const Vec3i p = lattice_.cubes[at(c)];
    if (lattice_.has_cube(at(c))) grid_[at((std::int64_t{p.z} * n.y + p.y) * n.x + p.x)] = c;
  }
}

Index LatticeCutter::regular_at(Vec3i p) const {
  const Vec3i n = lattice_.node_dims - Vec3i{1, 1, 1};
  if (p.x < 0 || p.y < 0 || p.z < 0 || p.x >= n.x || p.y >= n.y || p.z >= n.z) return -1;
  return grid_[at((std::int64_t{p.z} * n.y + p.y) * n.x + p.x)];
}

Index LatticeCutter::regular_of(Index cube) const {
  return cube < lattice_.regular_cubes() ? cube : lattice_.copies[at(cube - lattice_.regular_cubes())].of;
}

std::uint8_t LatticeCutter::corners(Index cube) const {
  return cube < lattice_.regular_cubes() ? std::uint8_t{0xFF}
                                         : lattice_.copies[at(cube - lattice_.regular_cubes())].corners;
}

std::span<const Index> LatticeCutter::live(Index regular) const {
  const auto cut = live_.find(regular);
  if (cut != live_.end()) return cut->second;
  return {&grid_[at((std::int64_t{lattice_.cubes[at(regular)].z} * (lattice_.node_dims.y - 1) +
                     lattice_.cubes[at(regular)].y) *
                        (lattice_.node_dims.x - 1) +
                    lattice_.cubes[at(regular)].x)],
          1};
}

std::uint64_t LatticeCutter::key(Index a, Index b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32U | static_cast<std::uint64_t>(std::max(a, b));
}

bool LatticeCutter::is_cut(Index cube, int a, int b) const {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  return cuts_.contains(key(nodes[at(a)], nodes[at(b)]));
}

double LatticeCutter::place(Index cube, int a, int b) const {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  const Index from = nodes[at(a)], to = nodes[at(b)];
  double t = 0.5;
  const auto cut = cuts_.find(key(from, to));
  if (cut != cuts_.end()) {
    t = double{cut->second};
  } else if (std::popcount(static_cast<unsigned>(a ^ b)) > 1) {
    // A diagonal beside which the strip ended: where the wall crosses edges that lead along it.
    double sum = 0;
    int count = 0;
    for (int e = 0; e < 12; ++e) {
      const auto [p, q] = kCornerPairs[at(e)];
      if ((p & ~(a | b)) != 0 || (q & a) != a || (q & ~b) != 0 || (p & a) != a) continue;
      const auto edge = cuts_.find(key(nodes[at(p)], nodes[at(q)]));
      if (edge == cuts_.end()) continue;
      const double along = nodes[at(p)] < nodes[at(q)] ? double{edge->second} : 1 - double{edge->second};
      const int axes = std::popcount(static_cast<unsigned>(a ^ b));
      sum += (std::popcount(static_cast<unsigned>(p ^ a)) + along) / axes;
      ++count;
    }
    return count == 0 ? 0.5 : std::clamp(sum / count, kFromNode, 1 - kFromNode);
  }
  return from < to ? t : 1 - t;
}

LatticeCutter::Marked LatticeCutter::mark(const BladeStrip& strip, std::span<const Vec3f> x_m) {
  Marked marked;
  Journal journal;
  const Box3f box = strip.box_m();
  const auto triangles = strip.triangles();
  const auto look = [&](Index cube) {
    const auto& nodes = lattice_.cube_nodes[at(cube)];
    Box3f own{x_m[at(nodes[0])], x_m[at(nodes[0])]};
    for (const Index node : nodes) own = {min(own.min, x_m[at(node)]), max(own.max, x_m[at(node)])};
    if (overlap(own, box)) mark_cube(cube, triangles, x_m, marked, journal);
  };
  for (Index c = 0; c < next_copy_; ++c)
    if (lattice_.cube_fill[at(c)] > 0) look(c);
  dirty_.insert(dirty_.end(), journal.cubes.begin(), journal.cubes.end());
  if (!journal.edges.empty()) journals_.push_back(std::move(journal));
  return marked;
}

void LatticeCutter::mark(const Journal& journal) {
  for (const Journal::Edge& edge : journal.edges) {
    if (edge.low < 0 || edge.low >= edge.high || edge.high >= next_node_ ||
        !(edge.place > 0 && edge.place < 1))
      throw Error("cut: an edge from node " + std::to_string(edge.low) + " to " + std::to_string(edge.high) +
                  " at " + std::to_string(edge.place) + ", the body has " + std::to_string(next_node_));
    cuts_.try_emplace(key(edge.low, edge.high), edge.place);
  }
  for (const Index cube : journal.cubes) {
    if (cube < 0 || cube >= next_copy_)
      throw Error("cut: cube " + std::to_string(cube) + ", the body has " + std::to_string(next_copy_));
    dirty_.push_back(cube);
  }
  journals_.push_back(journal);
}

void LatticeCutter::mark_cube(Index cube, const std::vector<std::array<NamedPoint, 3>>& strip,
                              std::span<const Vec3f> x_m, Marked& marked, Journal& journal) {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  const std::uint8_t own = corners(cube);
  bool is_new = false;
  for (int pair = 0; pair < kPairs; ++pair) {
    const auto [a, b] = kCornerPairs[at(pair)];
    const Index low = std::min(nodes[at(a)], nodes[at(b)]), high = std::max(nodes[at(a)], nodes[at(b)]);
    const NamedPoint from{x_m[at(low)], low}, to{x_m[at(high)], high};
    const Box3f way{min(from.x_m, to.x_m), max(from.x_m, to.x_m)};
    for (const auto& [c, d, e] : strip) {
      if (!overlap(way, {min(c.x_m, min(d.x_m, e.x_m)), max(c.x_m, max(d.x_m, e.x_m))})) continue;
      const double t = crossing(from, to, c, d, e);
      if (t < 0) continue;
      const bool is_refused = !may_cut_.empty() && may_cut_[at(regular_of(cube))] == 0;
      marked.refused = marked.refused || is_refused;
      if (is_refused) return;
      const bool is_material = (own >> a & own >> b & 1) != 0;
      is_new = is_new || is_material;
      const auto place = static_cast<float>(std::clamp(t, kFromNode, 1 - kFromNode));
      const bool added = cuts_.try_emplace(key(low, high), place).second;
      if (added) journal.edges.push_back({low, high, place});
      if (pair < 12 && added) ++marked.edges;
      break;
    }
  }
  if (is_new) journal.cubes.push_back(cube);
}

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
  std::unordered_map<Index, std::vector<Index>> before;
  affected_.clear();
  for (std::size_t k = 0; k < cubes.size(); ++k) {
    const Index regular = regular_of(cubes[k]);
    const std::span<const Index> now = live(regular);
    before.try_emplace(regular, now.begin(), now.end());
    replace_live(cubes[k], copy, parts[k]);
    copy += 2 * (parts[k] - 1);
    for (int q = 0; q < 8; ++q) affected_.push_back(lattice_.cubes[at(regular)] + step(q));
  }
  const auto by_place = [](Vec3i a, Vec3i b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); };
  std::sort(affected_.begin(), affected_.end(), by_place);
  affected_.erase(std::unique(affected_.begin(), affected_.end()), affected_.end());
  shared_.resize(affected_.size());
  tbb::parallel_for(std::size_t{0}, affected_.size(),
                    [&](std::size_t k) { shared_[k] = share_nodes(affected_[k]); });
  for (const SharedNodes& shared : shared_) nodes += shared.new_nodes;
  if (nodes <= lattice_.node_count()) return true;
  for (auto& [regular, was] : before) live_[regular] = std::move(was);
  affected_.clear();
  shared_.clear();
  return false;
}

/// @param first_copy of those that add_splits() made of `count` parts
void LatticeCutter::replace_live(Index cube, Index first_copy, Index count) {
  const Index regular = regular_of(cube);
  const std::span<const Index> now = live(regular);
  std::vector<Index> cubes(now.begin(), now.end());
  std::erase(cubes, cube);
  for (Index k = 0; k + 1 < count; ++k) cubes.push_back(first_copy + 2 * k);
  cubes.push_back(first_copy + 2 * count - 3);
  live_[regular] = std::move(cubes);
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
  shared_.clear();
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
LatticeCutter::SharedNodes LatticeCutter::share_nodes(Vec3i corner) const {
  SharedNodes shared;
  auto& entries = shared.entries;
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
  return shared;
}

void LatticeCutter::share_masses(Vec3i corner, const SharedNodes& shared, TopologyChange& change) {
  std::vector<std::pair<Index, float>> mass_kg;
  for (const auto& e : shared.entries) {
    auto place =
        std::find_if(mass_kg.begin(), mass_kg.end(), [&](const auto& m) { return m.first == e.node; });
    if (place == mass_kg.end()) place = mass_kg.insert(mass_kg.end(), {e.node, 0.F});
    place->second += lattice_.cube_mass_kg[at(e.cube)] / 8;
  }
  for (const auto& [node, mass] : mass_kg) {
    lattice_.node_mass_kg[at(node)] = mass;
    change.nodes.push_back(
        {.node = node, .from = -1, .layer = corner.z, .mass_kg = mass, .fixed = lattice_.fixed[at(node)]});
  }
}

TopologyChange LatticeCutter::commit(const std::vector<std::vector<CubeSplit>>& stages,
                                     const std::vector<std::vector<double>>& share) {
  TopologyChange change;
  std::unordered_map<Index, Index> root;  // of new copies: the cube that was there before
  std::vector<Index> touched;
  for (std::size_t s = 0; s < stages.size(); ++s) {
    for (std::size_t k = 0; k < stages[s].size(); ++k) {
      const CubeSplit& split = stages[s][k];
      const auto known = root.find(split.parent);
      const Index parent = known == root.end() ? split.parent : known->second;
      if (known == root.end()) change.cut.push_back({parent, lattice_.cubes[at(parent)].z});
      const double fill = double{lattice_.cube_fill[at(split.parent)]},
                   mass_kg = double{lattice_.cube_mass_kg[at(split.parent)]};
      lattice_.cube_fill[at(split.parent)] = lattice_.cube_mass_kg[at(split.parent)] = 0;
      for (const int part : {0, 1}) {
        const double of = part == 1 ? share[s][k] : 1 - share[s][k];
        lattice_.cube_fill[at(split.part[part])] = static_cast<float>(of * fill);
        lattice_.cube_mass_kg[at(split.part[part])] = static_cast<float>(of * mass_kg);
        root[split.part[part]] = parent;
        touched.push_back(split.part[part]);
      }
    }
  }
  const Index first_new = next_node_;
  for (SharedNodes& shared : shared_) {
    for (auto& e : shared.entries) {
      const bool is_new = e.node >= first_new;
      if (is_new) e.node += next_node_ - first_new;
      if (e.node == e.before) continue;
      if (is_new) add_node(e.node, e.before, change);
      lattice_.cube_nodes[at(e.cube)][at(e.corner)] = e.node;
      touched.push_back(e.cube);
    }
    next_node_ += shared.new_nodes;
  }
  std::sort(touched.begin(), touched.end());
  touched.erase(std::unique(touched.begin(), touched.end()), touched.end());
  for (const Index cube : touched) {
    if (!(lattice_.cube_fill[at(cube)] > 0)) continue;  // it fell apart in the next stage
    const auto known = root.find(cube);
    change.copies.push_back({cube, lattice_.copies[at(cube - lattice_.regular_cubes())],
                             known == root.end() ? cube : known->second, lattice_.cubes[at(cube)].z,
                             lattice_.cube_nodes[at(cube)], lattice_.cube_fill[at(cube)],
                             lattice_.cube_mass_kg[at(cube)]});
  }
  for (std::size_t k = 0; k < affected_.size(); ++k) share_masses(affected_[k], shared_[k], change);
  // A new node is listed once, with its mass.
  std::unordered_map<Index, std::size_t> first;
  std::vector<TopologyChange::Node> nodes;
  for (const TopologyChange::Node& n : change.nodes) {
    const auto [place, is_new] = first.try_emplace(n.node, nodes.size());
    if (is_new)
      nodes.push_back(n);
    else
      nodes[place->second].mass_kg = n.mass_kg;
  }
  change.nodes = std::move(nodes);
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

std::vector<Index> LatticeCutter::part_of_nodes() const {
  std::vector<Index> parent(lattice_.nodes.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index i) {
    while (parent[at(i)] != i) i = parent[at(i)] = parent[at(parent[at(i)])];
    return i;
  };
  for (Index c = 0; c < next_copy_; ++c) {
    if (!lattice_.has_cube(at(c))) continue;
    Index lowest = root(lattice_.cube_nodes[at(c)][0]);
    for (const Index i : lattice_.cube_nodes[at(c)]) {
      const Index other = root(i);
      parent[at(std::max(lowest, other))] = std::min(lowest, other);
      lowest = std::min(lowest, other);
    }
  }
  for (Index i = 0; i < lattice_.node_count(); ++i) parent[at(i)] = parent[at(parent[at(i)])];
  return parent;
}

int LatticeCutter::part_count() const {
  const std::vector<Index> part = part_of_nodes();
  int count = 0;
  std::vector<std::uint8_t> seen(part.size());
  for (Index c = 0; c < next_copy_; ++c) {
    if (!lattice_.has_cube(at(c))) continue;
    std::uint8_t& is_known = seen[at(part[at(lattice_.cube_nodes[at(c)][0])])];
    count += is_known == 0 ? 1 : 0;
    is_known = 1;
  }
  return count;
}

}  // namespace tactus::cut
