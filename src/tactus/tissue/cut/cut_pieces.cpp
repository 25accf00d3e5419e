// Pieces of triangles that walls go through: which there are, on which side they lie, and who moves them.
#include <algorithm>
#include <cmath>

#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/cut/cut_surface.h"
#include "tactus/tissue/cut/triangulate.h"

namespace tactus::cut {
namespace {

/// Either way round.
bool is_between(const std::array<Index, 2>& segment, Index a, Index b) {
  return (segment[0] == a && segment[1] == b) || (segment[0] == b && segment[1] == a);
}

}  // namespace

/// Both walls of an older cut have the same points, but each is cut on its own.
bool CutSurface::is_cut_at(const LatticeCutter& cutter, const Stage& s, const Triangle& t,
                           Index point) const {
  if (!s.is_crossing(point)) return true;
  const auto parents = s.parents.of(point - s.first_point);
  if (t.home < 0) {
    const Vec3d middle = (at(t.corner[0].point) + at(t.corner[1].point) + at(t.corner[2].point)) / 3.0;
    const Index regular = cutter.regular_of(s.lowest_parent(point));
    const Index there = leaf(regular, at(point) + 1e-3 * (middle - at(point)));
    return std::any_of(parents.begin(), parents.end(), [&](Index parent) { return parent == there; });
  }
  return std::any_of(parents.begin(), parents.end(), [&](Index parent) {
    return parent == t.home || (cutter.regular_of(parent) != cutter.regular_of(t.home) &&
                                nodes_of(cutter, {point, parent}) == nodes_of(cutter, {point, t.home}));
  });
}

std::vector<std::array<Index, 3>> CutSurface::divide(const std::array<Index, 3>& corners,
                                                     const EdgePoints& on_edge,
                                                     const std::vector<std::array<Index, 2>>& segments,
                                                     const std::function<bool(Index)>& counts) const {
  DividedTriangle d;
  std::vector<Index> sorted;
  std::vector<Index> ids(corners.begin(), corners.end());
  const Vec3d o = at(corners[0]), n = cross(at(corners[1]) - o, at(corners[2]) - o);
  const Vec3d size{std::abs(n.x), std::abs(n.y), std::abs(n.z)};
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const auto flat = [&](Index point) {
    const Vec3d p = at(point) - o;
    const Vec2d uv{p[(axis + 1) % 3], p[(axis + 2) % 3]};
    return n[axis] >= 0 ? uv : Vec2d{uv.y, uv.x};
  };
  for (std::size_t k = 0; k < 3; ++k) {
    const Index from = corners[k], to = corners[(k + 1) % 3];
    on_edge.get(edge_key(from, to), sorted);
    if (sorted.empty()) continue;
    if (counts) std::erase_if(sorted, [&](Index point) { return !counts(point); });
    std::sort(sorted.begin(), sorted.end(), [&](Index a, Index b) {
      return dot(at(a) - at(from), at(to) - at(from)) < dot(at(b) - at(from), at(to) - at(from));
    });
    for (const Index p : sorted) {
      if (std::find(ids.begin(), ids.end(), p) != ids.end()) continue;
      d.on_edge[k].push_back(static_cast<int>(ids.size()));
      ids.push_back(p);
    }
  }
  if (segments.empty() && ids.size() == 3) return {corners};
  const auto local = [&](Index point) {
    const auto known = std::find(ids.begin(), ids.end(), point);
    if (known != ids.end()) return static_cast<int>(known - ids.begin());
    ids.push_back(point);
    return static_cast<int>(ids.size()) - 1;
  };
  for (const auto& [a, b] : segments) {
    const int first = local(a);
    d.segments.push_back({first, local(b)});
  }
  for (const Index id : ids) d.points.push_back(flat(id));
  std::vector<std::array<Index, 3>> found;
  for (const auto& [a, b, c] : triangulate(d)) found.push_back({ids[index(a)], ids[index(b)], ids[index(c)]});
  return found;
}

/// Area over the square of the longest edge.
double CutSurface::roundness(std::size_t triangle) const {
  const auto& corner = triangles_[triangle].corner;
  const Vec3d a = at(corner[1].point) - at(corner[0].point), b = at(corner[2].point) - at(corner[0].point);
  return 0.5 * length(cross(a, b)) / std::max(std::max(dot(a, a), dot(b, b)), dot(b - a, b - a));
}

CutSurface::Inner CutSurface::inner_of(const Stage& s, const WallTriangle& wall) const {
  if (wall.segments.empty() && is_whole_still(wall.point, s.on_edge))
    return {.is_whole = inside(s.splits[wall.split], middle_of(wall.point))};
  return {.pieces = inner_pieces(s, wall)};
}

/// What of a wall lies in the body. Where the surface goes through the wall, that says it.
std::vector<std::array<Index, 3>> CutSurface::inner_pieces(const Stage& s, const WallTriangle& wall) const {
  std::vector<std::array<Index, 2>> segments;
  for (const Segment& segment : wall.segments) segments.push_back(segment.points);
  Divided d;
  d.pieces = divide(wall.point, s.on_edge, segments, {});
  d.segments = wall.segments;
  const auto area = [&](const std::array<Index, 3>& t) {
    return cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0]));
  };
  const Vec3d normal = area(wall.point);
  std::vector<std::array<Index, 3>> inner;
  std::vector<bool> seen(d.pieces.size());
  for (std::size_t first = 0; first < d.pieces.size(); ++first) {
    if (seen[first]) continue;
    const std::vector<std::size_t> pieces = region(d, first);
    double behind = 0, surest = 0;
    std::size_t widest = first;
    for (const std::size_t i : pieces) {
      seen[i] = true;
      if (dot(area(d.pieces[i]), normal) > dot(area(d.pieces[widest]), normal)) widest = i;
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = d.pieces[i][k], b = d.pieces[i][(k + 1) % 3];
        const auto segment = std::find_if(wall.segments.begin(), wall.segments.end(),
                                          [&](const Segment& e) { return is_between(e.points, a, b); });
        if (segment == wall.segments.end()) continue;
        const auto& corner = triangles_[segment->other].corner;
        const Vec3d out = area(std::array{corner[0].point, corner[1].point, corner[2].point});
        const Vec3d into = cross(normal, at(b) - at(a));
        const double sure = dot(out, into) / std::sqrt(dot(out, out) * dot(normal, normal) + 1e-300) *
                            roundness(segment->other);
        if (std::abs(sure) > surest) surest = std::abs(sure), behind = -sure;
      }
    }
    const auto& [a, b, c] = d.pieces[widest];
    if (surest > 0 ? behind > 0 : inside(s.splits[wall.split], (at(a) + at(b) + at(c)) / 3.0))
      for (const std::size_t i : pieces) inner.push_back(d.pieces[i]);
  }
  return inner;
}

/// How much a piece with the edge from a to b lies on side 1 of a wall, which it has there: which way it
/// goes.
double CutSurface::side_of(const Stage& s, const Divided& d, std::size_t number, Index a, Index b) const {
  const auto& w = s.walls[number].point;
  const Vec3d to_1 = normalized(cross(at(w[1]) - at(w[0]), at(w[2]) - at(w[0])));
  return dot(to_1, cross(d.normal, at(b) - at(a)));
}

Vec3d CutSurface::middle_of(const std::array<Index, 3>& t) const {
  return (at(t[0]) + at(t[1]) + at(t[2])) / 3.0;
}

/// Distance from a wall's plane, positive on side 1.
double CutSurface::above_wall(const Stage& s, std::size_t number, Vec3d p) const {
  const auto& w = s.walls[number].point;
  return dot(normalized(cross(at(w[1]) - at(w[0]), at(w[2]) - at(w[0]))), p - at(w[0]));
}

/// Regions of pieces between walls, and of each on which side of which cube's wall it lies. Its longest edges
/// count most. A triangle that is nearly a line has no direction; there its farthest corner counts.
void CutSurface::find_sides(const Stage& s, Divided& d) const {
  d.region_of.assign(d.pieces.size(), -1);
  for (std::size_t first = 0; first < d.pieces.size(); ++first) {
    if (d.region_of[first] >= 0) continue;
    const std::vector<std::size_t> pieces = region(d, first);
    auto& sides = d.sides.emplace_back();
    std::vector<std::array<Index, 3>> seen;
    for (const std::size_t i : pieces) {
      d.region_of[i] = static_cast<int>(d.sides.size()) - 1;
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = d.pieces[i][k], b = d.pieces[i][(k + 1) % 3];
        for (const auto& [segment, number] : d.segments) {
          if (!is_between(segment, a, b)) continue;
          const auto split = static_cast<Index>(s.walls[number].split);
          Side& side = sides[split];
          side.is_both =
              side.is_both || std::find(seen.begin(), seen.end(), std::array{b, a, split}) != seen.end();
          seen.push_back({a, b, split});
          if (d.is_round) {
            side.vote += side_of(s, d, number, a, b);
            continue;
          }
          for (const std::size_t j : pieces)
            for (const Index point : d.pieces[j])
              if (const double above = above_wall(s, number, at(point));
                  std::abs(above) > std::abs(side.vote))
                side.vote = above;
        }
      }
    }
  }
}

/// Pieces that hang together without a wall between them.
std::vector<std::size_t> CutSurface::region(const Divided& d, std::size_t piece) {
  std::vector<std::size_t> found{piece};
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = d.pieces[found[i]][k], b = d.pieces[found[i]][(k + 1) % 3];
      if (std::any_of(d.segments.begin(), d.segments.end(),
                      [&](const Segment& e) { return is_between(e.points, a, b); }))
        continue;
      for (std::size_t j = 0; j < d.pieces.size(); ++j) {
        const auto& t = d.pieces[j];
        if (((t[0] == b && t[1] == a) || (t[1] == b && t[2] == a) || (t[2] == b && t[0] == a)) &&
            std::find(found.begin(), found.end(), j) == found.end())
          found.push_back(j);
      }
    }
  }
  return found;
}

/// Round a point of a piece, up to the first wall: the part of that wall's cube on this side; -1: there is
/// none.
Index CutSurface::part_round(const Stage& s, const Divided& d, std::size_t piece, std::size_t corner) const {
  const Index pivot = d.pieces[piece][corner];
  for (const bool forwards : {true, false}) {
    std::size_t now = piece;
    for (std::size_t steps = 0; steps < d.pieces.size(); ++steps) {
      const auto& t = d.pieces[now];
      const std::size_t k = t[0] == pivot ? 0 : t[1] == pivot ? 1 : 2;
      const Index a = forwards ? pivot : t[(k + 2) % 3], b = forwards ? t[(k + 1) % 3] : pivot;
      for (const auto& [segment, number] : d.segments)
        if (is_between(segment, a, b)) {
          const std::size_t split = s.walls[number].split;
          const Side& side = d.sides[index(d.region_of[piece])].at(static_cast<Index>(split));
          double vote = side.vote;
          if (side.is_both && steps == 0) vote = side_of(s, d, number, a, b);
          // Before the end of a wall both ways round are right as yet; later only the shorter one is.
          if (side.is_both && steps > 0) vote = above_wall(s, number, middle_of(d.pieces[piece]));
          return s.splits[split].split.part[vote > 0 ? 1 : 0];
        }
      const auto beside = std::find_if(d.pieces.begin(), d.pieces.end(), [&](const auto& other) {
        return (other[0] == b && other[1] == a) || (other[1] == b && other[2] == a) ||
               (other[2] == b && other[0] == a);
      });
      if (beside == d.pieces.end()) break;
      now = static_cast<std::size_t>(beside - d.pieces.begin());
    }
  }
  return -1;
}

/// Who moves a point at the end of older walls, if the material next to it in a piece is cut now.
Index CutSurface::copy_beside(const LatticeCutter& cutter, const Stage& s, Corner corner, Vec3d inner) const {
  const Vec3d p = at(corner.point);
  Vec3i cell;
  for (int a = 0; a < 3; ++a) cell[a] = static_cast<Index>(std::floor(is_whole(p[a]) ? inner[a] : p[a]));
  const Index regular = cutter.regular_at(cell);
  for (const Split& split : s.splits)
    if (split.regular == regular &&
        nodes_of(cutter, {corner.point, split.split.parent}) == nodes_of(cutter, corner))
      return leaf(split.split.parent, inner);
  return leaf(corner.cube, inner);
}

/// Who moves the corners of a piece from now on. @param d none: the triangle is not divided
void CutSurface::set_cubes(const LatticeCutter& cutter, const Stage& s, const Divided* d, std::size_t piece,
                           Triangle& t) const {
  const Vec3d middle = (at(t.corner[0].point) + at(t.corner[1].point) + at(t.corner[2].point)) / 3.0;
  if (t.home >= 0) {
    if (const Index place = parted_place_[index(t.home)]; place >= 0) {
      Index part = -1;
      for (std::size_t k = 0; k < 3 && part < 0 && d != nullptr; ++k) part = part_round(s, *d, piece, k);
      const Parted& parted = parted_[index(place)];
      t.home = part >= 0 ? part : parted.part[index(parted.wall.side(middle))];
    }
    for (Corner& corner : t.corner) corner.cube = t.home;
    return;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    Corner& corner = t.corner[k];
    const Point& point = points_[index(corner.point)];
    if (const Index part = d != nullptr ? part_round(s, *d, piece, k) : -1; part >= 0) {
      corner.cube = part;
      continue;
    }
    // Without a wall of its own, a new point of an edge has what its neighbour has.
    if (corner.cube < 0) corner.cube = cutter.regular_of(s.lowest_parent(corner.point));
    const Vec3d inner = point.is_wall ? point.p + 1e-3 * (middle - point.p) : point.p;
    corner.cube = point.is_wall && s.rim.contains(static_cast<std::uint64_t>(corner.point))
                      ? copy_beside(cutter, s, corner, inner)
                      : leaf(corner.cube, inner);
  }
}

/// Nothing is deeper than what was measured last and the way to there.
void CutSurface::note_depth(Vec3d p) {
  if (measured_.depth + length(p - measured_.p) <= deepest_) return;
  measured_ = {p, static_cast<double>(solid_->distance_m(vec_cast<float>(p)))};
  deepest_ = std::max(deepest_, measured_.depth);
}

/// A triangle in pieces; none: it stays whole. @param number in s.near
std::unique_ptr<CutSurface::Divided> CutSurface::divided(const LatticeCutter& cutter, const Stage& s,
                                                         std::size_t number) const {
  const Triangle& old = triangles_[index(s.near[number])];
  const std::array<Index, 3> corners{old.corner[0].point, old.corner[1].point, old.corner[2].point};
  const auto place = static_cast<Index>(number);
  if (old.is_fill || (s.segments.empty(place) && is_whole_still(corners, s.on_edge))) return nullptr;
  auto d = std::make_unique<Divided>();
  d->normal = cross(at(corners[1]) - at(corners[0]), at(corners[2]) - at(corners[0]));
  d->is_round = roundness(index(s.near[number])) > 1e-4;
  std::vector<std::array<Index, 2>> segments;
  for (const Segment& segment : s.segments.of(place)) {
    d->segments.push_back(segment);
    segments.push_back(segment.points);
  }
  d->pieces =
      divide(corners, s.on_edge, segments, [&](Index point) { return is_cut_at(cutter, s, old, point); });
  find_sides(s, *d);
  return d;
}

std::vector<CutSurface::Triangle> CutSurface::pieces_of(const LatticeCutter& cutter, const Stage& s,
                                                        const Divided& d, const Triangle& old) const {
  std::vector<Triangle> pieces(d.pieces.size(), old);
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    for (std::size_t j = 0; j < 3; ++j) {
      const Index point = d.pieces[k][j];
      const auto same = std::find_if(old.corner.begin(), old.corner.end(),
                                     [&](const Corner& c) { return c.point == point; });
      pieces[k].corner[j] = same != old.corner.end() ? *same : Corner{point, -1};
    }
    set_cubes(cutter, s, &d, k, pieces[k]);
  }
  return pieces;
}

void CutSurface::part_cubes(const Stage& s) {
  for (const Split& split : s.splits) {
    parted_place_[index(split.split.parent)] = static_cast<Index>(parted_.size());
    parted_.push_back({split.wall, {split.split.part[0], split.split.part[1]}});
    for (const Index part : split.split.part) parent_[index(part)] = split.split.parent;
  }
}

/// @param in_pieces per triangle in s.near; none: it stays whole
void CutSurface::divide_near(const LatticeCutter& cutter, const Stage& s,
                             const std::vector<std::unique_ptr<Divided>>& in_pieces) {
  part_cubes(s);
  std::vector<std::vector<Triangle>> pieces(s.near.size());
  cpu_for(s.near.size(), 16, [&](std::size_t i) {
    Triangle& old = triangles_[index(s.near[i])];
    if (in_pieces[i])
      pieces[i] = pieces_of(cutter, s, *in_pieces[i], old);
    else if (!old.is_fill)
      set_cubes(cutter, s, nullptr, 0, old);
  });
  for (std::size_t i = 0; i < s.near.size(); ++i) {
    for (std::size_t k = 0; k < pieces[i].size(); ++k) {
      if (k == 0)
        triangles_[index(s.near[i])] = pieces[i][k];
      else
        add_triangle(cutter, pieces[i][k]);
    }
  }
}

/// How deep walls lie is looked up beside the rest.
void CutSurface::add_walls(const LatticeCutter& cutter, const Stage& s, const std::vector<Inner>& inner) {
  const auto for_each_piece = [&](auto&& f) {
    for (std::size_t w = 0; w < s.walls.size(); ++w) {
      if (inner[w].is_whole) f(w, s.walls[w].point);
      for (const auto& piece : inner[w].pieces) f(w, piece);
    }
  };
  const auto note_depths = [&] {
    for_each_piece([&](std::size_t, const std::array<Index, 3>& piece) { note_depth(middle_of(piece)); });
  };
  const auto add = [&](std::size_t w, const std::array<Index, 3>& piece) {
    const CubeSplit& split = s.splits[s.walls[w].split].split;
    const auto& [a, b, c] = piece;
    wall_area_ += 0.5 * length(cross(at(b) - at(a), at(c) - at(a)));
    next_walls_.push_back({{at(a), at(b), at(c)}, {split.part[0], split.part[1]}});
    std::array<Index, 2> place{};
    std::size_t count = 0;
    for (const int part : {0, 1}) {
      const Index cube = split.part[part];
      place[count] = place_triangle(
          {{{{a, cube}, {part == 0 ? b : c, cube}, {part == 0 ? c : b, cube}}}, cube, s.walls[w].tet});
      if (place[count] >= 0) ++count;
    }
    if (count > 0) add_to_bins(cutter, std::span(place).first(count));
  };
  cpu_for(2, 1, [&](int task) {
    if (task == 0)
      for_each_piece(add);
    else
      note_depths();
  });
}

}  // namespace tactus::cut
