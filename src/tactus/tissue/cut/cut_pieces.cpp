// Pieces of triangles that walls go through: which there are, on which side they lie, and which cubes move
// them.
#include <algorithm>
#include <cmath>

#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/cut/cut_surface.h"
#include "tactus/tissue/cut/triangulate.h"

namespace tactus::cut {
namespace {

/// Either way round. Without branches, as they would be unpredictable.
bool is_between(const std::array<Index, 2>& segment, Index a, Index b) {
  return (((segment[0] ^ a) | (segment[1] ^ b)) == 0) | (((segment[0] ^ b) | (segment[1] ^ a)) == 0);
}
/// In this order.
bool has_edge(const std::array<Index, 3>& t, Index a, Index b) {
  return (((t[0] ^ a) | (t[1] ^ b)) == 0) | (((t[1] ^ a) | (t[2] ^ b)) == 0) |
         (((t[2] ^ a) | (t[0] ^ b)) == 0);
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

/// Along d's segments and points on its edges. @param counts which of these do
template <class Counts>
void CutSurface::divide(const std::array<Index, 3>& corners, const EdgePoints& on_edge, const Counts& counts,
                        Divided& d) const {
  DividedTriangle flat;
  ShortList<Index, 16> ids;
  ids.append(corners.begin(), corners.end());
  ShortList<Index, 8> sorted;
  for (std::size_t k = 0; k < 3; ++k) {
    const Index from = corners[k], to = corners[(k + 1) % 3];
    sorted.clear();
    on_edge.for_each(edge_key(from, to), [&](Index point) {
      if (counts(point)) sorted.push_back(point);
    });
    std::sort(sorted.begin(), sorted.end(), [&](Index a, Index b) {
      return dot(at(a) - at(from), at(to) - at(from)) < dot(at(b) - at(from), at(to) - at(from));
    });
    for (const Index p : sorted) {
      if (std::find(ids.begin(), ids.end(), p) != ids.end()) continue;
      flat.on_edge[k].push_back(static_cast<int>(ids.size()));
      ids.push_back(p);
    }
  }
  d.pieces.clear();
  if (d.segments.empty() && ids.size() == 3) {
    d.pieces.push_back(corners);
    return;
  }
  const auto local = [&](Index point) {
    const auto known = static_cast<std::size_t>(std::find(ids.begin(), ids.end(), point) - ids.begin());
    if (known == ids.size()) ids.push_back(point);
    return static_cast<int>(known);
  };
  for (const Segment& segment : d.segments) {
    const int first = local(segment.points[0]);
    flat.segments.push_back({first, local(segment.points[1])});
  }
  const Vec3d o = at(corners[0]), n = cross(at(corners[1]) - o, at(corners[2]) - o);
  const Vec3d size{std::abs(n.x), std::abs(n.y), std::abs(n.z)};
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  for (const Index id : ids) {
    const Vec3d p = at(id) - o;
    const Vec2d uv{p[(axis + 1) % 3], p[(axis + 2) % 3]};
    flat.points.push_back(n[axis] >= 0 ? uv : Vec2d{uv.y, uv.x});
  }
  ShortList<std::array<int, 3>, 16> found;
  triangulate(flat, found);
  for (const auto& [a, b, c] : found) d.pieces.push_back({ids[index(a)], ids[index(b)], ids[index(c)]});
}

/// Area over the square of the longest edge.
double CutSurface::roundness(std::size_t triangle) const {
  const auto& corner = triangles_[triangle].corner;
  const Vec3d a = at(corner[1].point) - at(corner[0].point), b = at(corner[2].point) - at(corner[0].point);
  return 0.5 * length(cross(a, b)) / std::max(std::max(dot(a, a), dot(b, b)), dot(b - a, b - a));
}

/// Which edges of pieces are segments, and which piece is beside them.
void CutSurface::link_pieces(Divided& d) {
  d.edges.resize(d.pieces.size());
  for (std::size_t i = 0; i < d.pieces.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const Index a = d.pieces[i][k], b = d.pieces[i][(k + 1) % 3];
      Divided::Edge& edge = d.edges[i][k];
      edge = {-1, -1};
      for (std::size_t n = 0; n < d.segments.size() && edge.segment < 0; ++n)
        if (is_between(d.segments[n].points, a, b)) edge.segment = static_cast<int>(n);
      for (std::size_t j = 0; j < d.pieces.size() && edge.beside < 0; ++j)
        if (has_edge(d.pieces[j], b, a)) edge.beside = static_cast<int>(j);
    }
  }
}

/// Pieces that hang together without a wall between them.
void CutSurface::find_region(const Divided& d, std::size_t piece, Places& found) {
  found.clear();
  found.push_back(piece);
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::size_t now = found[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [beside, segment] = d.edges[now][k];
      if (segment >= 0 || beside < 0) continue;
      for (std::size_t j = index(beside); j < d.pieces.size(); ++j)
        if (has_edge(d.pieces[j], d.pieces[now][(k + 1) % 3], d.pieces[now][k]) &&
            std::find(found.begin(), found.end(), j) == found.end())
          found.push_back(j);
    }
  }
}

/// Keeps the pieces of a wall that lie in the body. Where the surface goes through the wall, it says which
/// do.
void CutSurface::keep_inner_pieces(const Stage& s, std::size_t number, Divided& d) const {
  d.segments.clear();
  for (const Segment& segment : s.wall_segments.of(static_cast<Index>(number))) d.segments.push_back(segment);
  divide(
      s.walls[number].point, s.on_edge, [](Index) { return true; }, d);
  link_pieces(d);
  ShortList<Piece, 8> inner;
  d.region_of.resize(d.pieces.size());
  std::fill(d.region_of.begin(), d.region_of.end(), -1);
  Places region;
  for (std::size_t first = 0; first < d.pieces.size(); ++first) {
    if (d.region_of[first] >= 0) continue;
    find_region(d, first, region);
    for (const std::size_t i : region) d.region_of[i] = static_cast<int>(first);
    if (!is_inner(s, number, d, region)) continue;
    for (const std::size_t i : region) inner.push_back(d.pieces[i]);
  }
  d.pieces = inner;
}

bool CutSurface::is_inner(const Stage& s, std::size_t number, const Divided& d, const Places& region) const {
  const auto area = [&](const Piece& t) { return cross(at(t[1]) - at(t[0]), at(t[2]) - at(t[0])); };
  const WallTriangle& wall = s.walls[number];
  const Vec3d normal = area(wall.point);
  double behind = 0, surest = 0;
  std::size_t widest = region.front();
  for (const std::size_t i : region) {
    if (dot(area(d.pieces[i]), normal) > dot(area(d.pieces[widest]), normal)) widest = i;
    for (std::size_t k = 0; k < 3; ++k) {
      if (d.edges[i][k].segment < 0) continue;
      const std::size_t other = d.segments[index(d.edges[i][k].segment)].other;
      const auto& corner = triangles_[other].corner;
      const Vec3d out = area({corner[0].point, corner[1].point, corner[2].point});
      const Vec3d into = cross(normal, at(d.pieces[i][(k + 1) % 3]) - at(d.pieces[i][k]));
      const double sure =
          dot(out, into) / std::sqrt(dot(out, out) * dot(normal, normal) + 1e-300) * roundness(other);
      if (std::abs(sure) > surest) surest = std::abs(sure), behind = -sure;
    }
  }
  return surest > 0 ? behind > 0 : inside(s, s.splits[wall.split], middle_of(d.pieces[widest]));
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

/// Regions of pieces between walls, and of each on which side of which cube's wall it lies.
void CutSurface::find_sides(const Stage& s, Divided& d) const {
  d.sides.clear();
  d.region_of.resize(d.pieces.size());
  std::fill(d.region_of.begin(), d.region_of.end(), -1);
  Places region;
  ShortList<std::array<Index, 3>, 8> seen;
  int number_of_region = 0;
  for (std::size_t first = 0; first < d.pieces.size(); ++first) {
    if (d.region_of[first] >= 0) continue;
    find_region(d, first, region);
    seen.clear();
    for (const std::size_t i : region) {
      d.region_of[i] = number_of_region;
      for (std::size_t k = 0; k < 3; ++k) {
        if (d.edges[i][k].segment < 0) continue;
        const Index a = d.pieces[i][k], b = d.pieces[i][(k + 1) % 3];
        for (std::size_t n = index(d.edges[i][k].segment); n < d.segments.size(); ++n) {
          if (!is_between(d.segments[n].points, a, b)) continue;
          const std::size_t number = d.segments[n].other;
          const auto split = static_cast<Index>(s.walls[number].split);
          Side& side = d.side(number_of_region, split);
          side.is_both =
              side.is_both || std::find(seen.begin(), seen.end(), std::array{b, a, split}) != seen.end();
          seen.push_back({a, b, split});
          add_vote(s, d, region, side, number, {a, b});
        }
      }
    }
    ++number_of_region;
  }
}

/// The longest edges count most. A triangle that is nearly a line has no direction; there its farthest corner
/// counts.
void CutSurface::add_vote(const Stage& s, const Divided& d, const Places& region, Side& side,
                          std::size_t number, std::array<Index, 2> edge) const {
  if (d.is_round) {
    side.vote += side_of(s, d, number, edge[0], edge[1]);
    return;
  }
  for (const std::size_t j : region)
    for (const Index point : d.pieces[j])
      if (const double above = above_wall(s, number, at(point)); std::abs(above) > std::abs(side.vote))
        side.vote = above;
}

/// Round a point of a piece, up to the first wall: the part of that wall's cube on this side; -1: there is
/// none.
Index CutSurface::part_round(const Stage& s, const Divided& d, std::size_t piece, std::size_t corner) const {
  const Index pivot = d.pieces[piece][corner];
  for (const bool forwards : {true, false}) {
    std::size_t now = piece;
    for (std::size_t steps = 0; steps < d.pieces.size(); ++steps) {
      const Piece& t = d.pieces[now];
      const std::size_t k = t[0] == pivot ? 0 : t[1] == pivot ? 1 : 2, from = forwards ? k : (k + 2) % 3;
      const auto [beside, segment] = d.edges[now][from];
      if (segment >= 0) {
        const std::size_t number = d.segments[index(segment)].other, split = s.walls[number].split;
        // Pieces that are nearly lines may be of another region, which knows no side of this wall.
        const Side* known = d.find_side(d.region_of[piece], static_cast<Index>(split));
        const bool is_known = known != d.sides.end();
        const Side side = is_known ? *known : Side{d.region_of[piece], static_cast<Index>(split), 0, true};
        double vote = side.vote;
        if (side.is_both && (steps == 0 || !is_known))
          vote = side_of(s, d, number, t[from], t[(from + 1) % 3]);
        // Before the end of a wall both ways round are right as yet; later only the shorter one is.
        if (side.is_both && steps > 0 && is_known) vote = above_wall(s, number, middle_of(d.pieces[piece]));
        return s.splits[split].split.part[vote > 0 ? 1 : 0];
      }
      if (beside < 0) break;
      now = index(beside);
    }
  }
  return -1;
}

/// The cube or copy that moves a point at the end of older walls, if the material next to it in a piece is
/// cut now.
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

/// Sets the cubes or copies that move the corners of a piece from now on. @param d none: the triangle is not
/// divided
void CutSurface::set_cubes(const LatticeCutter& cutter, const Stage& s, const Divided* d, std::size_t piece,
                           Triangle& t) const {
  const Vec3d middle = (at(t.corner[0].point) + at(t.corner[1].point) + at(t.corner[2].point)) / 3.0;
  if (t.home >= 0) {
    if (const Index place = parted_place_[index(t.home)]; place >= 0) {
      Index part = -1;
      for (std::size_t k = 0; k < 3 && part < 0 && d != nullptr; ++k) part = part_round(s, *d, piece, k);
      const Parted& parted = parted_[index(place)];
      t.home = part >= 0 ? part : parted.part_at(middle);
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
    // Without a wall of its own, a new point of an edge has its neighbour's cube.
    if (corner.cube < 0) corner.cube = cutter.regular_of(s.lowest_parent(corner.point));
    const Vec3d inner = point.is_wall ? point.p + 1e-3 * (middle - point.p) : point.p;
    corner.cube = point.is_wall && s.rim.contains(static_cast<std::uint64_t>(corner.point))
                      ? copy_beside(cutter, s, corner, inner)
                      : leaf(corner.cube, inner);
  }
}

/// No point is deeper than a measured one plus the distance to it. So one of each kRun points that follow one
/// another is measured, then those of the others that may be deeper than all of these.
void CutSurface::note_depths() {
  constexpr std::size_t kRun = 16;
  const auto measured = [&](const Vec3d& p) {
    const auto depth = static_cast<double>(solid_->distance_m(vec_cast<float>(p)));
    deepest_ = std::max(deepest_, depth);
    return depth;
  };
  const auto sample_of = [&](std::size_t run) {
    return wall_middles_[std::min(run * kRun + kRun / 2, wall_middles_.size() - 1)];
  };
  run_depths_.resize((wall_middles_.size() + kRun - 1) / kRun);
  for (std::size_t run = 0; run < run_depths_.size(); ++run) run_depths_[run] = measured(sample_of(run));
  for (std::size_t i = 0; i < wall_middles_.size(); ++i) {
    const Vec3d sample = sample_of(i / kRun), &p = wall_middles_[i];
    if (p != sample && run_depths_[i / kRun] + length(p - sample) > deepest_) measured(p);
  }
}

void CutSurface::divide_triangle(const LatticeCutter& cutter, const Stage& s, std::size_t number,
                                 Divided& d) const {
  const Triangle& old = triangles_[index(s.near[number])];
  const Piece corners{old.corner[0].point, old.corner[1].point, old.corner[2].point};
  d.normal = cross(at(corners[1]) - at(corners[0]), at(corners[2]) - at(corners[0]));
  d.is_round = roundness(index(s.near[number])) > 1e-7;
  d.segments.clear();
  for (const Segment& segment : s.segments.of(static_cast<Index>(number))) d.segments.push_back(segment);
  divide(
      corners, s.on_edge, [&](Index point) { return is_cut_at(cutter, s, old, point); }, d);
  link_pieces(d);
  find_sides(s, d);
}

/// Finds the shares of cubes, and the triangles that are in pieces. It changes nothing that others read.
void CutSurface::find_pieces(const LatticeCutter& cutter, Stage& s) {
  const std::size_t near = s.near.size(), splits = s.splits.size(), walls = s.walls.size();
  s.shares.resize(splits);
  s.found.resize(splits);
  s.is_sliver.resize(splits);
  s.empty_side.resize(splits);
  s.near_pieces.resize(near);
  s.wall_pieces.resize(walls);
  const auto is_whole = [&](const Chains<Segment>& segments, std::size_t list, const Piece& corners) {
    return segments.empty(static_cast<Index>(list)) && is_whole_still(corners, s.on_edge);
  };
  cpu_for(near + splits + walls, 16, [&](std::size_t i) {
    if (i < near) {
      const Triangle& t = triangles_[index(s.near[i])];
      const Piece corners{t.corner[0].point, t.corner[1].point, t.corner[2].point};
      s.near_pieces[i] = t.is_fill || is_whole(s.segments, i, corners) ? kWhole : kInPieces;
    } else if (i < near + splits) {
      find_share(cutter, s, i - near);
    } else {
      const std::size_t w = i - near - splits;
      const WallTriangle& wall = s.walls[w];
      const bool is_bare = !(cutter.lattice().cube_fill[index(s.splits[wall.split].split.parent)] > 0);
      s.wall_pieces[w] = is_bare                                     ? kOutside
                         : !is_whole(s.wall_segments, w, wall.point) ? kInPieces
                         : wall.may_be_whole && inside(s, s.splits[wall.split], middle_of(wall.point))
                             ? kWhole
                             : kOutside;
    }
  });
  dividing_.clear();
  for (const bool is_wall : {false, true}) {
    std::vector<Index>& places = is_wall ? s.wall_pieces : s.near_pieces;
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i] != kInPieces) continue;
      places[i] = static_cast<Index>(dividing_.size());
      dividing_.push_back({is_wall, i});
    }
  }
  if (divided_.size() < dividing_.size()) divided_.resize(dividing_.size());
  cpu_for(dividing_.size(), 4, [&](std::size_t k) {
    if (dividing_[k].is_wall)
      keep_inner_pieces(s, dividing_[k].number, divided_[k]);
    else
      divide_triangle(cutter, s, dividing_[k].number, divided_[k]);
  });
}

void CutSurface::make_triangles(const LatticeCutter& cutter, const Stage& s, const Triangle& old,
                                Divided& d) const {
  d.triangles.resize(d.pieces.size());
  for (std::size_t k = 0; k < d.pieces.size(); ++k) {
    Triangle& t = d.triangles[k] = old;
    for (std::size_t j = 0; j < 3; ++j) {
      const Index point = d.pieces[k][j];
      const auto same = std::find_if(old.corner.begin(), old.corner.end(),
                                     [&](const Corner& c) { return c.point == point; });
      t.corner[j] = same != old.corner.end() ? *same : Corner{point, -1};
    }
    set_cubes(cutter, s, &d, k, t);
  }
}

void CutSurface::part_cubes(const Stage& s) {
  Index place = static_cast<Index>(parted_.size() - s.splits.size());
  for (const Split& split : s.splits) {
    parted_place_[index(split.split.parent)] = place++;
    for (const Index part : split.split.part) parent_[index(part)] = split.split.parent;
  }
}

void CutSurface::divide_near(const LatticeCutter& cutter, const Stage& s) {
  part_cubes(s);
  cpu_for(s.near.size(), 16, [&](std::size_t i) {
    Triangle& old = triangles_[index(s.near[i])];
    if (s.near_pieces[i] >= 0)
      make_triangles(cutter, s, old, divided_[index(s.near_pieces[i])]);
    else if (!old.is_fill)
      set_cubes(cutter, s, nullptr, 0, old);
  });
  for (std::size_t k = 0; k < dividing_.size() && !dividing_[k].is_wall; ++k) {
    const auto& pieces = divided_[k].triangles;
    for (std::size_t j = 0; j < pieces.size(); ++j) {
      if (j == 0)
        triangles_[index(s.near[dividing_[k].number])] = pieces[j];
      else
        add_triangle(cutter, pieces[j]);
    }
  }
}

/// On both sides.
void CutSurface::add_wall(const LatticeCutter& cutter, const Stage& s, std::size_t number,
                          const Piece& piece) {
  const CubeSplit& split = s.splits[s.walls[number].split].split;
  const auto& [a, b, c] = piece;
  wall_area_ += 0.5 * length(cross(at(b) - at(a), at(c) - at(a)));
  next_walls_.push_back({{at(a), at(b), at(c)}, {split.part[0], split.part[1]}});
  std::array<Index, 2> place{};
  std::size_t count = 0;
  for (const int part : {0, 1}) {
    const Index cube = split.part[part];
    place[count] = place_triangle(
        {{{{a, cube}, {part == 0 ? b : c, cube}, {part == 0 ? c : b, cube}}}, cube, s.walls[number].tet});
    if (place[count] >= 0) ++count;
  }
  if (count > 0) add_to_bins(cutter, std::span(place).first(count));
}

/// How deep walls lie is looked up beside the rest.
void CutSurface::add_walls(const LatticeCutter& cutter, const Stage& s) {
  const auto for_each_piece = [&](auto&& f) {
    for (std::size_t w = 0; w < s.walls.size(); ++w) {
      if (s.wall_pieces[w] == kWhole) f(w, s.walls[w].point);
      if (s.wall_pieces[w] < 0) continue;
      for (const Piece& piece : divided_[index(s.wall_pieces[w])].pieces) f(w, piece);
    }
  };
  cpu_for(2, 1, [&](int task) {
    if (task == 0) {
      for_each_piece([&](std::size_t w, const Piece& piece) { add_wall(cutter, s, w, piece); });
    } else {
      wall_middles_.clear();
      for_each_piece([&](std::size_t, const Piece& piece) { wall_middles_.push_back(middle_of(piece)); });
      note_depths();
    }
  });
}

}  // namespace tactus::cut
