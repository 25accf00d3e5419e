#include "tactus/tissue/cut/lattice_cutter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <string>

#include "tactus/base/error.h"
#include "tactus/compute/cpu_for.h"

namespace tactus::cut {
namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

/// Walls stay so far from nodes, in spacings.
constexpr double kFromNode = 5e-5;
/// Cubes that are looked at together.
constexpr Index kCubeBlock = 16;

Box3f box_of(std::span<const Vec3f> points) {
  Box3f box{points.front(), points.front()};
  for (const Vec3f p : points) box = {min(box.min, p), max(box.max, p)};
  return box;
}

bool overlap(const Box3f& a, const Box3f& b) {
  return a.min.x <= b.max.x && a.min.y <= b.max.y && a.min.z <= b.max.z && b.min.x <= a.max.x &&
         b.min.y <= a.max.y && b.min.z <= a.max.z;
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

template <class F>
void BladeStrip::for_each_triangle(F&& f) const {
  const auto named = [&](const std::vector<Vec3f>& of, std::size_t k, int when) {
    return NamedPoint{of[k], -1 - 2 * static_cast<std::int64_t>(k) - when % 2};
  };
  for (std::size_t k = 0; k + 1 < begin_m.size(); ++k) {
    const NamedPoint a = named(begin_m, k, frame), b = named(begin_m, k + 1, frame),
                     c = named(end_m, k + 1, frame + 1), d = named(end_m, k, frame + 1);
    f(a, b, c);
    f(a, c, d);
  }
}

double BladeStrip::area_m2() const {
  double area = 0;
  for_each_triangle([&](const NamedPoint& a, const NamedPoint& b, const NamedPoint& c) {
    area += 0.5 * length(cross(vec_cast<double>(b.x_m - a.x_m), vec_cast<double>(c.x_m - a.x_m)));
  });
  return area;
}

void BladeStrip::add_triangles_to(std::vector<NamedTriangle>& found) const {
  for_each_triangle(
      [&](const NamedPoint& a, const NamedPoint& b, const NamedPoint& c) { found.emplace_back(a, b, c); });
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
    if (lattice_.has_cube(at(c))) grid_[cell(p)] = c;
  }
  cut_place_.assign(at(lattice_.regular_cubes()), -1);
  cuts_.reserve(4 * lattice_.copies.size());
  find_blocks();
  take_room_for_frame(std::min(lattice_.copies.size() / 2, kFrameSplits));
}

/// Per cube that falls apart, as much as walls of one layer need.
void LatticeCutter::take_room_for_frame(std::size_t splits) {
  take_room(live_, lattice_.copies.size() / 2);
  take_room(dirty_, 2 * splits);
  take_room(dirty_cubes_, 2 * splits);
  take_room(affected_, 4 * splits);
  take_room(at_corners_, 32 * splits);
  strip_.reserve(400);
  take_room(hits_, first_of_cubes_.size());
  take_room(crossed_, 2 * splits);
  take_room(falling_, splits);
  take_room(before_, splits);
  stages_.resize(1);
  take_room(stages_.front(), splits);
  take_room(found_, 4 * splits);
  take_room(root_, 2 * splits);
  take_room(journal_.edges, 16 * splits);
  take_room(journal_.cubes, 2 * splits);
}

/// Regular cubes keep their nodes as long as they are whole.
void LatticeCutter::find_blocks() {
  std::vector<Index> blocks;
  for (Index first = 0; first < lattice_.regular_cubes(); first += kCubeBlock) {
    first_of_cubes_.push_back(static_cast<Index>(blocks_of_cubes_.size()));
    blocks.clear();
    for (Index c = first; c < std::min(first + kCubeBlock, lattice_.regular_cubes()); ++c)
      for (const Index node : lattice_.cube_nodes[at(c)])
        blocks.push_back(node / static_cast<Index>(PointBlocks::kSize));
    std::sort(blocks.begin(), blocks.end());
    blocks_of_cubes_.insert(blocks_of_cubes_.end(), blocks.begin(),
                            std::unique(blocks.begin(), blocks.end()));
  }
  first_of_cubes_.push_back(static_cast<Index>(blocks_of_cubes_.size()));
}

std::uint64_t LatticeCutter::key(Index a, Index b) {
  return static_cast<std::uint64_t>(std::min(a, b)) << 32U | static_cast<std::uint64_t>(std::max(a, b));
}

/// Bits of the cube's edges, as in kCornerPairs.
std::uint32_t LatticeCutter::cut_edges(Index cube) const {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  std::uint32_t found = 0;
  for (unsigned e = 0; e < 12; ++e) {
    const auto [a, b] = kCornerPairs[e];
    if (cuts_.contains(key(nodes[at(a)], nodes[at(b)]))) found |= 1U << e;
  }
  return found;
}

double LatticeCutter::place(Index cube, int a, int b) const {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  const Index from = nodes[at(a)], to = nodes[at(b)];
  double t = 0.5;
  if (const float* cut = cuts_.find(key(from, to)); cut != nullptr) {
    t = double{*cut};
  } else if (std::popcount(static_cast<unsigned>(a ^ b)) > 1) {
    // A diagonal beside which the strip ended: where the wall crosses edges that lead along it.
    double sum = 0;
    int count = 0;
    for (int e = 0; e < 12; ++e) {
      const auto [p, q] = kCornerPairs[at(e)];
      if ((p & ~(a | b)) != 0 || (q & a) != a || (q & ~b) != 0 || (p & a) != a) continue;
      const float* edge = cuts_.find(key(nodes[at(p)], nodes[at(q)]));
      if (edge == nullptr) continue;
      const double along = nodes[at(p)] < nodes[at(q)] ? double{*edge} : 1 - double{*edge};
      const int axes = std::popcount(static_cast<unsigned>(a ^ b));
      sum += (std::popcount(static_cast<unsigned>(p ^ a)) + along) / axes;
      ++count;
    }
    return count == 0 ? 0.5 : std::clamp(sum / count, kFromNode, 1 - kFromNode);
  }
  return from < to ? t : 1 - t;
}

/// Cubes and copies whose boxes meet a box, ascending. Where the box is thinnest few of them do, so that way
/// is looked at first.
void LatticeCutter::find_cubes_in(const Box3f& box, std::span<const Vec3f> x_m) {
  blocks_.build(x_m);
  const Vec3f size = box.extent();
  std::array<int, 3> axes{0, 1, 2};
  std::sort(axes.begin(), axes.end(), [&](int a, int b) { return size[a] < size[b]; });
  const auto meets = [&](Index cube) {
    if (!(lattice_.cube_fill[at(cube)] > 0)) return false;
    const auto& nodes = lattice_.cube_nodes[at(cube)];
    for (const int axis : axes) {
      float low = x_m[at(nodes[0])][axis], high = low;
      for (std::size_t q = 1; q < 8; ++q) {
        const float x = x_m[at(nodes[q])][axis];
        low = std::min(low, x);
        high = std::max(high, x);
      }
      if (low > box.max[axis] || box.min[axis] > high) return false;
    }
    return true;
  };
  hits_.resize(first_of_cubes_.size() - 1);
  cpu_for(hits_.size(), 64, [&](std::size_t b) {
    hits_[b] = 0;
    Box3f all = blocks_.boxes()[at(blocks_of_cubes_[at(first_of_cubes_[b])])];
    for (Index k = first_of_cubes_[b] + 1; k < first_of_cubes_[b + 1]; ++k) {
      const Box3f& of = blocks_.boxes()[at(blocks_of_cubes_[at(k)])];
      all = {min(all.min, of.min), max(all.max, of.max)};
    }
    if (!overlap(all, box)) return;
    const Index first = kCubeBlock * static_cast<Index>(b),
                count = std::min(kCubeBlock, lattice_.regular_cubes() - first);
    for (Index k = 0; k < count; ++k) hits_[b] |= meets(first + k) ? 1U << static_cast<unsigned>(k) : 0U;
  });
  found_.clear();
  for (std::size_t b = 0; b < hits_.size(); ++b)
    for (std::uint32_t left = hits_[b]; left != 0; left &= left - 1)
      found_.push_back(kCubeBlock * static_cast<Index>(b) + std::countr_zero(left));
  for (Index c = lattice_.regular_cubes(); c < next_copy_; ++c)
    if (meets(c)) found_.push_back(c);
}

LatticeCutter::Marked LatticeCutter::mark(const BladeStrip& strip, std::span<const Vec3f> x_m) {
  Marked marked;
  journal_.edges.clear();
  journal_.cubes.clear();
  strip_.clear();
  strip.add_triangles_to(strip_);
  find_cubes_in(strip.box_m(), x_m);
  crossed_.resize(std::max(crossed_.size(), found_.size()));
  cpu_for(found_.size(), 16, [&](std::size_t k) { find_crossed(found_[k], x_m, crossed_[k]); });
  for (std::size_t k = 0; k < found_.size(); ++k) mark_cube(found_[k], crossed_[k], marked);
  dirty_.insert(dirty_.end(), journal_.cubes.begin(), journal_.cubes.end());
  if (!journal_.edges.empty()) journals_.push_back(journal_);
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

/// A pair is crossed by the first triangle that has its corners on two sides. Sides are looked up once per
/// corner.
void LatticeCutter::find_crossed(Index cube, std::span<const Vec3f> x_m, Crossed& found) const {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  std::array<NamedPoint, 8> corner;
  for (std::size_t q = 0; q < 8; ++q) corner[q] = {x_m[at(nodes[q])], nodes[q]};
  Box3f box{corner[0].x_m, corner[0].x_m};
  for (const NamedPoint& c : corner) box = {min(box.min, c.x_m), max(box.max, c.x_m)};
  found.pairs = 0;
  for (const NamedTriangle& triangle : strip_) {
    if (!overlap(box, triangle.box_m())) continue;
    std::array<NamedTriangle::End, 8> end;
    unsigned sides = 0;
    for (std::size_t q = 0; q < 8; ++q) {
      end[q] = triangle.end(corner[q]);
      sides |= (end[q].side > 0 ? 1U : 0U) << q;
    }
    if (sides == 0 || sides == 255) continue;
    for (std::size_t pair = 0; pair < kPairs; ++pair) {
      auto [a, b] = kCornerPairs[pair];
      if (((sides >> a ^ sides >> b) & 1U) == 0 || (found.pairs >> pair & 1U) != 0) continue;
      const Vec3f from = corner[at(a)].x_m, to = corner[at(b)].x_m;
      if (!overlap({min(from, to), max(from, to)}, triangle.box_m())) continue;
      if (nodes[at(a)] > nodes[at(b)]) std::swap(a, b);
      const double t = triangle.crossing(corner[at(a)], end[at(a)], corner[at(b)], end[at(b)]);
      if (t < 0) continue;
      found.pairs |= 1U << pair;
      found.place[pair] = static_cast<float>(std::clamp(t, kFromNode, 1 - kFromNode));
    }
  }
}

void LatticeCutter::mark_cube(Index cube, const Crossed& crossed, Marked& marked) {
  if (crossed.pairs == 0) return;
  if (!may_cut_.empty() && may_cut_[at(regular_of(cube))] == 0) {
    marked.refused = true;
    return;
  }
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  const std::uint8_t own = corners(cube);
  bool is_new = false;
  for (std::uint32_t left = crossed.pairs; left != 0; left &= left - 1) {
    const int pair = std::countr_zero(left);
    const auto [a, b] = kCornerPairs[at(pair)];
    is_new = is_new || (own >> a & own >> b & 1) != 0;
    const Index low = std::min(nodes[at(a)], nodes[at(b)]), high = std::max(nodes[at(a)], nodes[at(b)]);
    const float place = crossed.place[at(pair)];
    const bool added = cuts_.try_emplace(key(low, high), place).second;
    if (added) journal_.edges.push_back({low, high, place});
    if (pair < 12 && added) ++marked.edges;
  }
  if (is_new) journal_.cubes.push_back(cube);
}

/// Whole cubes in a row are one set, whose number is that of its first cube. Where the next cube of a row
/// meets the sets that its predecessor met, nothing is joined.
std::vector<Index> LatticeCutter::part_of_nodes() const {
  std::vector<Index> parent(at(next_copy_)), set_of(lattice_.nodes.size(), -1);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](Index i) {
    while (parent[at(i)] != i) i = parent[at(i)] = parent[at(parent[at(i)])];
    return i;
  };
  std::array<Index, 8> met{};
  Index set = -1;
  for (Index c = 0; c < next_copy_; ++c) {
    if (!lattice_.has_cube(at(c))) continue;
    const Vec3i step = c > 0 ? lattice_.cubes[at(c)] - lattice_.cubes[at(c - 1)] : Vec3i{};
    const bool goes_on =
        set >= 0 && c < lattice_.regular_cubes() && lattice_.has_cube(at(c - 1)) && step == Vec3i{1, 0, 0};
    if (!goes_on) {
      set = c;
      met.fill(-1);
    }
    // The left nodes of one that goes on are the right ones of the cube before.
    for (std::size_t q = goes_on ? 1 : 0; q < 8; q += goes_on ? 2 : 1) {
      Index& of = set_of[at(lattice_.cube_nodes[at(c)][q])];
      if (of < 0) of = set;
      if (of == set || of == met[q]) continue;
      met[q] = of;
      const Index a = root(of), b = root(set);
      parent[at(std::max(a, b))] = std::min(a, b);
    }
  }
  std::vector<Index> part(lattice_.nodes.size()), lowest(at(next_copy_), -1);
  for (Index i = 0; i < lattice_.node_count(); ++i) {
    part[at(i)] = i;
    if (set_of[at(i)] < 0) continue;
    Index& of = lowest[at(root(set_of[at(i)]))];
    if (of < 0) of = i;
    part[at(i)] = of;
  }
  return part;
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
