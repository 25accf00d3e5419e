// Which edges of a lattice a blade crosses, in a body that moves.
#include <algorithm>
#include <bit>
#include <cmath>
#include <string>

#include "tactus/base/at.h"
#include "tactus/base/error.h"
#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus::cut {
namespace {

/// A node this near to where a blade is about to pass is taken to the same side as all others, in spacings:
/// blades find it so far from there.
constexpr float kNearBlade = 0.01F, kOffBlade = 0.02F;
/// A node this near to a wall is on its side of it for good: blades find it so much farther away.
constexpr float kNearWall = 0.02F, kOffWall = 0.02F;
/// So far ahead of a strip's end nodes are looked at.
constexpr float kAhead = 0.5F;
/// Nodes go no farther than this, in spacings, between two moves of the blade; in so many steps at most.
/// While the blade moves they are half a step from where they should be: no farther than kNearBlade.
constexpr float kStep = 0.02F;
constexpr int kMostSteps = 40;

Box3f box_of(std::span<const Vec3f> points) {
  Box3f box{points.front(), points.front()};
  for (const Vec3f p : points) box = {min(box.min, p), max(box.max, p)};
  return box;
}

bool overlap(const Box3f& a, const Box3f& b) {
  return a.min.x <= b.max.x && a.min.y <= b.max.y && a.min.z <= b.max.z && b.min.x <= a.max.x &&
         b.min.y <= a.max.y && b.min.z <= a.max.z;
}

void keep_node_off(Index node, std::vector<Vec3f>& kept_off, std::vector<Index>& near_wall, Vec3f by) {
  if (kept_off[at(node)] == Vec3f{}) near_wall.push_back(node);
  kept_off[at(node)] += by;
}

/// The surface that a segment of a blade's edge is about to sweep, as a plane near a point of it.
class SweptPlane {
 public:
  SweptPlane(std::span<const Vec3f> begin, std::span<const Vec3f> end, std::size_t k)
      : from_(begin[k]), along_(begin[k + 1] - begin[k]), way_{end[k] - begin[k], end[k + 1] - begin[k + 1]} {
    const float ahead = kAhead + max(length(way_[0]), length(way_[1]));
    const Vec3f far{ahead, ahead, ahead};
    box_ = {min(begin[k], begin[k + 1]) - far, max(begin[k], begin[k + 1]) + far};
  }
  const Box3f& box() const { return box_; }
  /// Where a point lies before the edge; false: beside it, behind it or too far ahead.
  bool faces(Vec3f p) {
    const float along2 = dot(along_, along_);
    if (!(along2 > 0)) return false;
    const Vec3f d = p - from_;
    Vec3f way = way_[0];
    for (int k = 0; k < 2; ++k) {
      const float share = clamp(dot(d, along_) / along2, 0.F, 1.F);
      way = way_[0] + share * (way_[1] - way_[0]);
    }
    const Vec3f across = cross(along_, way);
    const float size = length(across);
    constexpr float kLeast = 1e-3F;  // of a way, in spacings: a shorter one has no direction
    if (!(size > kLeast * length(along_))) return false;
    normal_ = across / size;
    above_ = dot(normal_, d);
    // d = a along + b way + above normal.
    const float a = dot(normal_, cross(d, way)) / size, b = dot(normal_, cross(along_, d)) / size;
    // Segments overlap a little: by rounding, a point before their common end is before neither.
    constexpr float kOverlap = 0.01F;
    return a >= -kOverlap && a <= 1 + kOverlap && b >= 0 && (b - 1) * length(way) <= kAhead;
  }
  Vec3f normal() const { return normal_; }
  float above() const { return above_; }

 private:
  Vec3f from_, along_, way_[2], normal_{};
  Box3f box_;
  float above_ = 0;
};

/// Whether a cube round a node lies that way.
bool has_cube(const LatticeCutter& cutter, std::size_t node, Vec3f way) {
  constexpr float kAside =
      0.05F;  // of a spacing: the middle of a cube whose edge lies along the blade's plane
  for (int q = 0; q < 8; ++q) {
    const Vec3i corner{q & 1, q >> 1 & 1, q >> 2};
    const Vec3f to_middle = Vec3f{0.5F, 0.5F, 0.5F} - vec_cast<float>(corner);
    if (dot(to_middle, way) > kAside && cutter.regular_at(cutter.lattice().nodes[node] - corner) >= 0)
      return true;
  }
  return false;
}

/// Takes nodes that a blade is about to graze off its way, all to one side; those in a face of the body,
/// behind which nothing is, to the body's. Else each would go where rounding takes it, and walls would run to
/// and fro between them. @param before where they come from @param ways of nodes that are taken off
void keep_off_blade(const LatticeCutter& cutter, std::span<const Vec3f> begin, std::span<const Vec3f> end,
                    std::span<const Vec3f> before, std::span<const Vec3f> nodes, std::vector<Vec3f>& kept_off,
                    std::vector<Index>& near_wall, std::vector<std::pair<Index, Vec3f>>& ways) {
  ways.clear();
  std::vector<SweptPlane> planes;
  Box3f all{begin[0], begin[0]};
  for (std::size_t k = 0; k + 1 < begin.size(); ++k) {
    planes.emplace_back(begin, end, k);
    all = {min(all.min, planes.back().box().min), max(all.max, planes.back().box().max)};
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Vec3f p = 0.5F * (before[i] + nodes[i]);  // there it is when the blade passes
    if (!overlap({p, p}, all)) continue;
    for (SweptPlane& plane : planes) {
      if (!overlap({p, p}, plane.box()) || !plane.faces(p)) continue;
      if (std::abs(plane.above()) >= kNearBlade) break;
      const Vec3f known = normalized(kept_off[i]);
      Vec3f way = plane.normal() - dot(plane.normal(), known) * known;
      const float part = dot(way, plane.normal());
      if (part < 0.2F) break;  // it is kept off this way already
      const float to = has_cube(cutter, i, plane.normal()) ? kOffBlade : -kOffBlade;
      way = (to - plane.above()) / part * way;
      ways.emplace_back(static_cast<Index>(i), way);
      keep_node_off(static_cast<Index>(i), kept_off, near_wall, way);
      break;
    }
  }
}

/// Where the plane of a triangle crosses the way between two nodes that blades find elsewhere.
double place_between(const NamedTriangle& triangle, NamedPoint a, Vec3f off_a, NamedPoint b, Vec3f off_b) {
  const bool a_is_above = triangle.end(a).above > triangle.end(b).above;
  a.x_m -= off_a;
  b.x_m -= off_b;
  const double of_a = triangle.end(a).above, of_b = triangle.end(b).above;
  if ((of_a > of_b) != a_is_above || of_a == of_b) return 0.5;
  return std::clamp(of_a / (of_a - of_b), 0.0, 1.0);
}

}  // namespace

Box3f BladeStrip::box_m() const {
  const Box3f a = box_of(begin_m), b = end_m.empty() ? a : box_of(end_m);
  return {min(a.min, b.min), max(a.max, b.max)};
}

NamedPoint BladeStrip::named(const std::vector<Vec3f>& of, std::size_t k, int when) {
  return {of[k], -1 - 2 * static_cast<std::int64_t>(k) - when % 2};
}

template <class F>
void BladeStrip::for_each_triangle(F&& f) const {
  for (std::size_t k = 0; k + 1 < end_m.size(); ++k) {
    const auto [a, b] = begin_segment(k);
    const NamedPoint c = named(end_m, k + 1, frame + 1), d = named(end_m, k, frame + 1);
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

/// Cubes and copies whose boxes meet a box, ascending. Where the box is thinnest few of them do, so that way
/// is looked at first.
void LatticeCutter::find_cubes_in(const Box3f& box, const Sweep& sweep) {
  blocks_.build(sweep.to);
  if (sweep.moves()) blocks_before_.build(sweep.from);
  const Vec3f size = box.extent();
  std::array<int, 3> axes{0, 1, 2};
  std::sort(axes.begin(), axes.end(), [&](int a, int b) { return size[a] < size[b]; });
  const auto meets = [&](Index cube) {
    if (!(lattice_.cube_fill[at(cube)] > 0)) return false;
    const auto& nodes = lattice_.cube_nodes[at(cube)];
    for (const int axis : axes) {
      float low = sweep.to[at(nodes[0])][axis], high = low;
      const auto add = [&](std::span<const Vec3f> x, std::size_t first) {
        for (std::size_t q = first; q < 8; ++q) {
          low = std::min(low, x[at(nodes[q])][axis]);
          high = std::max(high, x[at(nodes[q])][axis]);
        }
      };
      add(sweep.to, 1);
      if (sweep.moves()) add(sweep.from, 0);
      if (low > box.max[axis] || box.min[axis] > high) return false;
    }
    return true;
  };
  hits_.resize(first_of_cubes_.size() - 1);
  cpu_for(hits_.size(), 64, [&](std::size_t b) {
    hits_[b] = 0;
    Box3f all = blocks_.boxes()[at(blocks_of_cubes_[at(first_of_cubes_[b])])];
    for (Index k = first_of_cubes_[b]; k < first_of_cubes_[b + 1]; ++k) {
      const Box3f& of = blocks_.boxes()[at(blocks_of_cubes_[at(k)])];
      all = {min(all.min, of.min), max(all.max, of.max)};
      if (!sweep.moves()) continue;
      const Box3f& before = blocks_before_.boxes()[at(blocks_of_cubes_[at(k)])];
      all = {min(all.min, before.min), max(all.max, before.max)};
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
  const Sweep sweep{strip, x_m, x_m, {}, {}};
  find_cubes_in(strip.box_m(), sweep);
  mark(sweep, marked);
  keep_journal();
  return marked;
}

void LatticeCutter::keep_journal() {
  dirty_.insert(dirty_.end(), journal_.cubes.begin(), journal_.cubes.end());
  if (!journal_.edges.empty()) journals_.push_back(journal_);
}

/// In the cubes that find_cubes_in() found.
void LatticeCutter::mark(const Sweep& sweep, Marked& marked) {
  strip_.clear();
  sweep.strip.add_triangles_to(strip_);
  crossed_.resize(std::max(crossed_.size(), found_.size()));
  cpu_for(found_.size(), 16, [&](std::size_t k) {
    crossed_[k].pairs = 0;
    if (sweep.moves()) find_swept(found_[k], sweep, crossed_[k]);
    find_crossed(found_[k], sweep, crossed_[k]);
  });
  for (std::size_t k = 0; k < found_.size(); ++k) mark_cube(found_[k], crossed_[k], marked);
}

void LatticeCutter::place_nodes(const RestFrame& frame, std::span<const Vec3f> x_m,
                                std::vector<Vec3f>& nodes) const {
  nodes.resize(x_m.size());
  frame.to_rest(x_m, nodes);
  for (const Index i : near_wall_) nodes[at(i)] += kept_off_[at(i)];
}

/// Places of the blade's edge and of all nodes are taken relative to the nodes round the edge, so a common
/// motion of both is none. They go to their new places in turns, in small steps.
LatticeCutter::Marked LatticeCutter::mark(BladeTrail& trail, const BladeStrip& strip,
                                          std::span<const Vec3f> before_m, std::span<const Vec3f> x_m) {
  // Nodes near walls were kept off them.
  const auto counts = [&](std::size_t i) { return lattice_.node_mass_kg[i] > 0 && kept_off_[i] == Vec3f{}; };
  const auto frame_at = [&](const std::vector<Vec3f>& edge_m, std::span<const Vec3f> nodes_m,
                            std::span<const Vec3f> before) {
    Box3f box = box_of(edge_m);
    const float reach_m = 3 * lattice_.spacing_m;
    box = {box.min - Vec3f{reach_m, reach_m, reach_m}, box.max + Vec3f{reach_m, reach_m, reach_m}};
    const RestFrame frame = RestFrame::fit(before, nodes_m, lattice_.spacing_m, counts, box, trail.turn);
    trail.turn = frame.turn;
    return frame;
  };
  const auto edge_at = [&](const RestFrame& frame, const std::vector<Vec3f>& edge_m) {
    const std::vector<Vec3f> points_m = trail.points_of(edge_m);
    std::vector<Vec3f> edge(points_m.size());
    frame.to_rest(points_m, edge);
    return edge;
  };
  if (trail.frame + 1 != strip.frame || trail.nodes.empty() || trail.parts.size() + 1 != strip.end_m.size()) {
    trail.begin(strip.begin_m, lattice_.spacing_m);
    next_nodes_.clear();
    for (const Vec3i p : lattice_.nodes) next_nodes_.push_back(vec_cast<float>(p));
    const RestFrame frame = frame_at(strip.begin_m, before_m, next_nodes_);
    trail.edge = edge_at(frame, strip.begin_m);
    place_nodes(frame, before_m, trail.nodes);
    trail.names.assign(trail.nodes.size(), 0);
  }
  const RestFrame frame = frame_at(strip.end_m, x_m, trail.nodes);
  const std::vector<Vec3f> edge = edge_at(frame, strip.end_m);
  place_nodes(frame, x_m, next_nodes_);
  keep_off_blade(*this, trail.edge, edge, trail.nodes, next_nodes_, kept_off_, near_wall_, off_ways_);
  Marked marked;
  journal_.edges.clear();
  journal_.cubes.clear();
  // All steps are on the way from where nodes and edge were to where they go, but for nodes that are taken
  // off.
  const Sweep whole{{trail.edge, edge}, trail.nodes, next_nodes_, {}, {}};
  const Box3f box = whole.strip.box_m();
  const Vec3f off{2 * kOffBlade, 2 * kOffBlade, 2 * kOffBlade};
  find_cubes_in({box.min - off, box.max + off}, whole);
  take_nodes_off(trail, marked);
  const int steps = steps_of(trail, edge);
  for (int k = 1; k <= steps; ++k) mark_step(trail, edge, k, steps, marked);
  keep_journal();
  trail.frame = strip.frame;
  return marked;
}

/// Nodes go off the blade's way while it stands, so it finds them there from where it starts.
void LatticeCutter::take_nodes_off(BladeTrail& trail, Marked& marked) {
  if (off_ways_.empty()) return;
  for (const auto& [node, way] : off_ways_) next_nodes_[at(node)] += way;
  std::vector<Vec3f> goal = trail.nodes;
  for (const auto& [node, way] : off_ways_) goal[at(node)] += way;
  std::swap(goal, next_nodes_);
  move_nodes(trail, 1);
  std::swap(goal, next_nodes_);
  mark({{trail.edge, {}, trail.steps}, step_nodes_, trail.nodes, step_names_, trail.names}, marked);
}

/// So many that no node near the blade goes far in one.
int LatticeCutter::steps_of(const BladeTrail& trail, const std::vector<Vec3f>& edge) const {
  const Box3f box = BladeStrip{trail.edge, edge}.box_m();
  float most2 = 0;
  for (std::size_t i = 0; i < next_nodes_.size(); ++i) {
    const Vec3f a = trail.nodes[i], b = next_nodes_[i];
    if (a == b || !overlap({min(a, b), max(a, b)}, box) || !(lattice_.node_mass_kg[i] > 0)) continue;
    most2 = std::max(most2, dot(b - a, b - a));
  }
  return std::clamp(static_cast<int>(std::ceil(std::sqrt(most2) / kStep)), 1, kMostSteps);
}

/// The k-th of some steps to `edge` and next_nodes_. Nodes go half of their way before the blade sweeps, and
/// half of it after that.
void LatticeCutter::mark_step(BladeTrail& trail, const std::vector<Vec3f>& edge, int k, int steps,
                              Marked& marked) {
  const float share = 1 / static_cast<float>(steps - k + 1);
  const auto on_the_way = [&](Vec3f a, Vec3f b) { return k == steps ? b : a + share * (b - a); };
  Sweep sweep;
  sweep.strip = {trail.edge, edge, trail.steps};
  for (std::size_t i = 0; i < edge.size(); ++i) sweep.strip.end_m[i] = on_the_way(trail.edge[i], edge[i]);
  const auto take_nodes = [&] {
    sweep.from = step_nodes_, sweep.from_name = step_names_;
    sweep.to = trail.nodes, sweep.to_name = trail.names;
  };
  move_nodes(trail, 0.5F * share);
  take_nodes();
  mark(sweep, marked);
  trail.edge = sweep.strip.end_m;
  ++trail.steps;
  if (!move_nodes(trail, k == steps ? 1.F : share / (2 - share))) return;
  take_nodes();
  sweep.strip = {trail.edge, {}, trail.steps};
  mark(sweep, marked);
}

/// Moves the trail's nodes by a share of their way to next_nodes_; where they were is in step_nodes_ then.
/// @returns whether one moved
bool LatticeCutter::move_nodes(BladeTrail& trail, float share) {
  std::swap(trail.nodes, step_nodes_);
  std::swap(trail.names, step_names_);
  trail.nodes.resize(next_nodes_.size());
  trail.names.resize(next_nodes_.size());
  constexpr std::size_t kBlock = 4096;
  std::vector<std::uint8_t> has_moved((trail.nodes.size() + kBlock - 1) / kBlock);
  cpu_for(has_moved.size(), 1, [&](std::size_t b) {
    std::uint8_t moved = 0;
    for (std::size_t i = b * kBlock; i < std::min((b + 1) * kBlock, trail.nodes.size()); ++i) {
      const Vec3f from = step_nodes_[i], to = next_nodes_[i];
      trail.nodes[i] = share == 1 ? to : from + share * (to - from);
      const std::uint8_t moves = trail.nodes[i] == from ? 0 : 1;
      trail.names[i] = step_names_[i] ^ moves;
      moved |= moves;
    }
    has_moved[b] = moved;
  });
  return std::find(has_moved.begin(), has_moved.end(), 1) != has_moved.end();
}

/// Notes a cut of an edge. A node that is near it stays on its side: blades find it a little farther away.
bool LatticeCutter::add_cut(Index low, Index high, float place) {
  if (!cuts_.try_emplace(key(low, high), place).second) return false;
  const Vec3i way = lattice_.nodes[at(high)] - lattice_.nodes[at(low)];
  if (high >= lattice_.regular_nodes() || std::abs(way.x) + std::abs(way.y) + std::abs(way.z) != 1)
    return true;
  const auto keep_off = [&](Index node, Vec3f to) {
    if (kept_off_[at(node)] == Vec3f{}) keep_node_off(node, kept_off_, near_wall_, to);
  };
  if (place < kNearWall) keep_off(low, -kOffWall * vec_cast<float>(way));
  if (place > 1 - kNearWall) keep_off(high, kOffWall * vec_cast<float>(way));
  return true;
}

void LatticeCutter::mark(const Journal& journal) {
  for (const Journal::Edge& edge : journal.edges) {
    if (edge.low < 0 || edge.low >= edge.high || edge.high >= next_node_ ||
        !(edge.place > 0 && edge.place < 1))
      throw Error("cut: an edge from node " + std::to_string(edge.low) + " to " + std::to_string(edge.high) +
                  " at " + std::to_string(edge.place) + ", the body has " + std::to_string(next_node_));
    add_cut(edge.low, edge.high, edge.place);
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
void LatticeCutter::find_crossed(Index cube, const Sweep& sweep, Crossed& found) const {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  std::array<NamedPoint, 8> corner;
  for (std::size_t q = 0; q < 8; ++q) corner[q] = sweep.node(nodes[q]);
  Box3f box{corner[0].x_m, corner[0].x_m};
  for (const NamedPoint& c : corner) box = {min(box.min, c.x_m), max(box.max, c.x_m)};
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
      const Index low = nodes[at(a)], high = nodes[at(b)];
      found.pairs |= 1U << pair;
      found.place[pair] = static_cast<float>(std::clamp(
          sweep.moves() && !(kept_off_[at(low)] == Vec3f{} && kept_off_[at(high)] == Vec3f{})
              ? place_between(triangle, corner[at(a)], kept_off_[at(low)], corner[at(b)], kept_off_[at(high)])
              : t,
          kFromNode, 1 - kFromNode));
    }
  }
}

/// Which pairs the blade's edge goes through while nodes move. A pair that moves sweeps two triangles.
void LatticeCutter::find_swept(Index cube, const Sweep& sweep, Crossed& found) const {
  const auto& nodes = lattice_.cube_nodes[at(cube)];
  std::array<NamedPoint, 8> before, after;
  Box3f box{sweep.to[at(nodes[0])], sweep.to[at(nodes[0])]};
  bool moves = false;
  for (std::size_t q = 0; q < 8; ++q) {
    before[q] = sweep.node_before(nodes[q]);
    after[q] = sweep.node(nodes[q]);
    moves = moves || before[q].id != after[q].id;
    for (const Vec3f p : {before[q].x_m, after[q].x_m}) box = {min(box.min, p), max(box.max, p)};
  }
  if (!moves) return;
  for (std::size_t k = 0; k + 1 < sweep.strip.begin_m.size(); ++k) {
    const auto [c, d] = sweep.strip.begin_segment(k);
    if (!overlap(box, {min(c.x_m, d.x_m), max(c.x_m, d.x_m)})) continue;
    for (int pair = 0; pair < kPairs; ++pair) {
      auto [a, b] = kCornerPairs[at(pair)];
      if (nodes[at(a)] > nodes[at(b)]) std::swap(a, b);
      const double t = swept_crossing({before[at(a)], before[at(b)]}, {after[at(a)], after[at(b)]}, c, d);
      if (t < 0 || (found.pairs >> static_cast<unsigned>(pair) & 1U) != 0) continue;
      found.pairs |= 1U << static_cast<unsigned>(pair);
      found.place[at(pair)] = static_cast<float>(std::clamp(t, kFromNode, 1 - kFromNode));
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
    const bool added = add_cut(low, high, place);
    if (added) journal_.edges.push_back({low, high, place});
    if (pair < 12 && added) ++marked.edges;
  }
  if (is_new) journal_.cubes.push_back(cube);
}

}  // namespace tactus::cut
