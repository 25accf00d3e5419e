// That each part of the lattice has a closed surface of its own.
#include <algorithm>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/cut/cut_geometry.h"
#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {

/// Whether a part of a cube has nothing of the body: no sample, no wall, no corner of the surface.
bool CutSurface::is_empty(const Stage& s, const Split& split, int side) const {
  for (std::size_t w = split.first_wall; w < split.end_wall; ++w) {
    const Index pieces = s.wall_pieces[w];
    if (pieces != kOutside && (pieces < 0 || !divided_[index(pieces)].pieces.empty())) return false;
  }
  for (const Index triangle : bins_.of(split.regular))
    for (const Corner& corner : triangles_[index(triangle)].corner)
      if (corner.cube == split.split.part[side]) return false;
  return true;
}

/// On which side of a wall, which the surface does not meet, it lies: points of its triangles tell, or, where
/// no triangle is, the corner of the cube that is nearest to it.
int CutSurface::side_of_faces(const LatticeCutter& cutter, const Stage& s, const Split& split) const {
  constexpr int kParts = 8;
  const Vec3d low = vec_cast<double>(cutter.lattice().cubes[index(split.regular)]),
              high = low + Vec3d{1, 1, 1};
  for (const Face& f : std::span(s.faces).subspan(split.first_face, split.face_count))
    for (int i = 0; i <= kParts; ++i)
      for (int j = 0; i + j <= kParts; ++j) {
        const Vec3d p = f.a + (i * (f.b - f.a) + j * (f.c - f.a)) / double{kParts};
        if (!apart(p, p, low, high)) return split.wall->side(p);
      }
  int nearest = 0;
  double least = 1e30;
  for (int q = 0; q < 8; ++q) {
    const Vec3d corner = low + vec_cast<double>(Vec3i{q & 1, q >> 1 & 1, q >> 2});
    if (const double d = depth(corner); d < least) least = d, nearest = q;
  }
  return split.split.sides >> nearest & 1;
}

/// Cubes at the surface reach out of the body. Space that a wall parts off there has no mass, so it is no
/// part.
void CutSurface::drop_empty_parts(const LatticeCutter& cutter, Stage& s) {
  for (std::size_t k = 0; k < s.splits.size(); ++k) {
    if (s.empty_side[k] == kNoSide || !s.splits[k].has_surface) continue;
    const int side =
        s.empty_side[k] == kBothSides ? 1 - side_of_faces(cutter, s, s.splits[k]) : s.empty_side[k];
    if (!is_empty(s, s.splits[k], side)) continue;
    s.shares[k] = s.found[k] = side == 0 ? 1 : 0;
    s.is_sliver[k] = 0;
    parted_[index(parted_place_[index(s.splits[k].split.parent)])].only = 1 - side;
  }
}

/// A corner whose copy shares no node with those of the others in its triangle, which agree, is on the wrong
/// side by rounding: it goes to the copy that agrees with them.
void CutSurface::mend_sides(const LatticeCutter& cutter, const std::vector<Index>& triangles) {
  const auto agree = [&](Index a, Index b) {
    if (a == b) return true;
    if (cutter.regular_of(a) == cutter.regular_of(b)) return false;
    const auto &of_a = cutter.lattice().cube_nodes[index(a)], &of_b = cutter.lattice().cube_nodes[index(b)];
    return std::any_of(of_a.begin(), of_a.end(),
                       [&](Index node) { return std::find(of_b.begin(), of_b.end(), node) != of_b.end(); });
  };
  const auto is_wrong = [&](const Triangle& t, std::size_t k) {
    const Index p = t.corner[(k + 1) % 3].cube, q = t.corner[(k + 2) % 3].cube;
    return !agree(t.corner[k].cube, p) && !agree(t.corner[k].cube, q) && agree(p, q);
  };
  is_mended_.resize(triangles.size());
  cpu_for(triangles.size(), 512, [&](std::size_t i) {
    const Triangle& t = triangles_[index(triangles[i])];
    const bool ab = agree(t.corner[0].cube, t.corner[1].cube), bc = agree(t.corner[1].cube, t.corner[2].cube),
               ca = agree(t.corner[2].cube, t.corner[0].cube);
    if (t.is_fill || t.home >= 0 || (ab && bc && ca))
      is_mended_[i] = 0;
    else
      is_mended_[i] = int{ab} + int{bc} + int{ca} == 1 ? 1 : 2;
  });
  std::map<Index, Index> original;  // cube of original points that go elsewhere
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    if (is_mended_[i] != 1) continue;
    Triangle& t = triangles_[index(triangles[i])];
    for (std::size_t k = 0; k < 3; ++k) {
      if (!is_wrong(t, k)) continue;
      Corner& corner = t.corner[k];
      const Index p = t.corner[(k + 1) % 3].cube, q = t.corner[(k + 2) % 3].cube;
      for (const Index copy : cutter.live(cutter.regular_of(corner.cube)))
        if (cutter.lattice().cube_fill[index(copy)] > 0 && agree(copy, p) && agree(copy, q))
          corner.cube = copy;
      if (!points_[index(corner.point)].is_wall) original[corner.point] = corner.cube;
    }
  }
  if (original.empty()) return;
  for (const Index triangle : triangles)
    for (Corner& corner : triangles_[index(triangle)].corner)
      if (const auto other = original.find(corner.point); other != original.end())
        corner.cube = other->second;
}

/// Triangles whose corners' cubes don't hang together as neighbours do, by rounding or as they are long, and
/// those with an original vertex that another triangle has moved by another cube. As long as the lattice is
/// in one piece there, nothing is wrong with them; a later cut may part it.
void CutSurface::note_suspects(const std::vector<Index>& triangles) {
  std::erase_if(suspects_,
                [&](Index t) { return std::binary_search(triangles.begin(), triangles.end(), t); });
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const Triangle& t = triangles_[index(triangles[i])];
    const bool is_moved_elsewhere =
        !t.is_fill && std::any_of(t.corner.begin(), t.corner.end(), [&](const Corner& c) {
          return !points_[index(c.point)].is_wall && vertex_cube_[index(c.point)] != c.cube;
        });
    if (is_mended_[i] != 0 || is_moved_elsewhere) suspects_.push_back(triangles[i]);
  }
}

/// Takes care that no triangle reaches from one part of the lattice to another, whenever it was made.
void CutSurface::separate(const LatticeCutter& cutter) {
  const bool is_open = edge_weight_ != 0 || !open_edges_.empty();
  if (!is_open && suspects_.empty()) return;
  const std::vector<Index> part_of_node = cutter.part_of_nodes();
  const auto part = [&](Index vertex) {
    const Index cube = vertex_cube_[index(vertex)];
    return part_of_node[index(cutter.lattice().cube_nodes[index(cube)][0])];
  };
  std::vector<Index> cubes;
  for (const Index triangle : suspects_) {
    const auto [a, b, c] = vertices_of_[index(triangle)];
    if (part(a) == part(b) && part(b) == part(c)) continue;
    for (const Corner& corner : triangles_[index(triangle)].corner) cubes.push_back(corner.cube);
  }
  if (!is_open && cubes.empty()) return;
  for (const Index cube : near_cubes_) set_.insert(cube);
  for (const Index cube : cubes) add_near(cutter, cube);
  take_near();
  drop_fills(cutter, near_);
  part_triangles(cutter, near_, part_of_node);
  name_vertices(cutter, near_);
}

/// Each triangle is of one part of the lattice: that of its original vertices, else that of most corners.
/// Corners on walls go to the copies of that part; where the others are of two parts, the triangle is
/// dropped, and fans close the hole that it leaves, in each part on its own.
void CutSurface::part_triangles(const LatticeCutter& cutter, const std::vector<Index>& triangles,
                                const std::vector<Index>& part_of_node) {
  const auto part = [&](Index cube) {
    return part_of_node[index(cutter.lattice().cube_nodes[index(cube)][0])];
  };
  // An original vertex that triangles put into two parts goes where its place is.
  std::map<Index, Index> part_of_point;
  const auto for_each_original = [&](auto&& f) {
    for (const Index triangle : triangles)
      for (Corner& corner : triangles_[index(triangle)].corner)
        if (!triangles_[index(triangle)].is_fill && !points_[index(corner.point)].is_wall) f(corner);
  };
  for_each_original([&](const Corner& corner) {
    const auto [known, is_new] = part_of_point.try_emplace(corner.point, part(corner.cube));
    if (known->second != part(corner.cube)) known->second = -1;
  });
  for_each_original([&](Corner& corner) {
    if (part_of_point.at(corner.point) < 0)
      corner.cube = leaf(cutter.regular_of(corner.cube), at(corner.point));
  });
  for (const Index triangle : triangles) {
    Triangle& t = triangles_[index(triangle)];
    const std::array<Index, 3> of{part(t.corner[0].cube), part(t.corner[1].cube), part(t.corner[2].cube)};
    if (t.is_fill || (of[0] == of[1] && of[1] == of[2])) continue;
    std::size_t first = of[1] == of[2] ? 1 : 0;  // a corner of the part that most have
    for (std::size_t k = 0; k < 3; ++k)
      if (!points_[index(t.corner[k].point)].is_wall) first = k;
    bool is_one = true;
    for (std::size_t k = 0; k < 3; ++k) {
      if (of[k] == of[first]) continue;
      Index to = -1;
      if (points_[index(t.corner[k].point)].is_wall)
        for (const Index copy : cutter.live(cutter.regular_of(t.corner[k].cube)))
          if (part(copy) == of[first] && cutter.lattice().cube_fill[index(copy)] > 0) to = copy;
      is_one = is_one && to >= 0;
      if (to >= 0) t.corner[k].cube = to;
    }
    if (!is_one) drop_triangle(triangle);
  }
}

/// Fills are made anew where something is cut: those whose places are near, whatever lists they are in. So of
/// fills at one place, in several parts, all go or none.
void CutSurface::drop_fills(const LatticeCutter& cutter, const std::vector<Index>& triangles) {
  for (const Index triangle : triangles) {
    const Triangle& t = triangles_[index(triangle)];
    if (!t.is_fill || !is_used(vertices_of_[index(triangle)])) continue;
    bool is_near = false;
    for_each_cell(at(t.corner[0].point), at(t.corner[1].point), at(t.corner[2].point), [&](Vec3i cell) {
      is_near =
          is_near || std::binary_search(near_cubes_.begin(), near_cubes_.end(), cutter.regular_at(cell));
    });
    if (is_near) drop_triangle(triangle);
  }
}

void CutSurface::drop_triangle(Index triangle) {
  Triangle& t = triangles_[index(triangle)];
  filled_ -= t.is_fill ? 1 : 0;
  t.is_fill = true;
  set_vertices(triangle, {0, 0, 0});
  free_.push_back(triangle);
}

/// Walls that meet under a flat angle leave dust: closed surfaces of less than the least fill, that move with
/// a part of the lattice which has a larger one. Its mass is with that part.
void CutSurface::drop_dust(const LatticeCutter& cutter) {
  may_be_bare_ = true;
  ClosedPieces all = closed_pieces(cutter);
  const auto is_extra = [&](const ClosedPiece& piece) { return piece.volume != all.largest.at(piece.part); };
  // The part that leaves an island may be in pieces, too.
  islands_ =
      4 * static_cast<Index>(std::count_if(all.pieces.begin(), all.pieces.end(), [&](const auto& piece) {
        return piece.second.volume >= kLeastFill && is_extra(piece.second);
      }));
  std::erase_if(all.pieces, [&](const auto& piece) {
    return std::abs(piece.second.volume) >= kLeastFill || !is_extra(piece.second);
  });
  if (all.pieces.empty()) return;
  for (Index triangle = 0; triangle < triangle_count(); ++triangle)
    if (const Piece& t = vertices_of_[index(triangle)];
        is_used(t) && all.pieces.contains(all.of_vertex[index(t[0])]))
      drop_triangle(triangle);
}

/// Edges that have no twin form loops of vertices, as a sum of triangles has no boundary's boundary.
std::vector<std::vector<Index>> CutSurface::open_loops() const {
  std::map<Index, std::vector<Index>> next;  // against the open edges
  for (const auto& [key, sum] : open_edges_) {
    const auto low = static_cast<Index>(key >> 32U), high = static_cast<Index>(key & 0xFFFFFFFFU);
    for (int k = 0; k < std::abs(sum); ++k) sum > 0 ? next[high].push_back(low) : next[low].push_back(high);
  }
  for (auto& [from, to] : next) std::sort(to.begin(), to.end());
  std::vector<std::vector<Index>> loops;
  while (!next.empty()) {
    std::vector<Index> way{next.begin()->first};
    while (true) {
      auto& out = next.at(way.back());
      const Index to = out.back();
      out.pop_back();
      if (out.empty()) next.erase(way.back());
      const auto seen = std::find(way.begin(), way.end(), to);
      if (seen == way.end()) {
        way.push_back(to);
        continue;
      }
      loops.emplace_back(seen, way.end());
      way.erase(seen + 1, way.end());
      if (!next.contains(way.back())) break;
    }
  }
  return loops;
}

/// Per loop, the point that its fan goes out from. Where a wall ends at another one, several parts of the
/// lattice lack triangles: mostly two, whose loops are one the other way round, else some whose loops hang
/// together. In the rest state these loops sum up to nothing, so fans from one point do, and no volume is
/// lost.
std::vector<Index> CutSurface::tips_of(const std::vector<std::vector<Index>>& loops) const {
  const auto point = [&](Index v) { return vertex_point_[index(v)]; };
  std::vector<Index> tips(loops.size());
  // The lowest point, of loops with a twin.
  std::map<std::vector<Index>, std::vector<std::size_t>> without_twin;
  for (std::size_t i = 0; i < loops.size(); ++i) {
    std::vector<Index> points;
    for (const Index v : loops[i]) points.push_back(point(v));
    const auto lowest_first = [](std::vector<Index>& p) {
      std::rotate(p.begin(), std::min_element(p.begin(), p.end()), p.end());
    };
    lowest_first(points);
    tips[i] = points.front();
    std::vector<Index> twin(points.rbegin(), points.rend());
    lowest_first(twin);
    const auto found = without_twin.find(twin);
    if (found == without_twin.end()) {
      without_twin[points].push_back(i);
      continue;
    }
    found->second.pop_back();
    if (found->second.empty()) without_twin.erase(found);
  }
  std::vector<std::size_t> others;
  for (const auto& [points, list] : without_twin) others.insert(others.end(), list.begin(), list.end());
  std::sort(others.begin(), others.end());
  // Those of the others that hang together get the point that most of them have.
  std::map<Index, std::vector<std::size_t>> loops_at;  // by point; once for each time
  for (const std::size_t i : others)
    for (const Index v : loops[i]) loops_at[point(v)].push_back(i);
  std::vector<std::uint8_t> is_known(loops.size());
  for (const std::size_t first : others) {
    if (is_known[first] != 0) continue;
    is_known[first] = 1;
    std::vector<std::size_t> group{first};
    std::size_t most = 0;
    Index tip = -1;
    for (std::size_t k = 0; k < group.size(); ++k)
      for (const Index v : loops[group[k]]) {
        const auto& here = loops_at.at(point(v));
        for (const std::size_t i : here)
          if (std::exchange(is_known[i], std::uint8_t{1}) == 0) group.push_back(i);
        if (here.size() < most || (here.size() == most && point(v) > tip)) continue;
        most = here.size();
        tip = point(v);
      }
    for (const std::size_t i : group) tips[i] = tip;
  }
  return tips;
}

/// A vertex at a point that moves with one of the cubes of a loop's vertices; -1: none of them holds it.
Index CutSurface::vertex_in(const LatticeCutter& cutter, const std::vector<Index>& loop, Index point) {
  if (!points_[index(point)].is_wall) return -1;
  const Vec3d p = at(point);
  for (const Index v : loop) {
    const Index cube = vertex_cube_[index(v)];
    const Vec3d low = vec_cast<double>(cutter.lattice().cubes[index(cube)]);
    if (apart(p, p, low, low + Vec3d{1, 1, 1})) continue;
    const std::array<Index, 8> nodes = nodes_of(cutter, {point, cube});
    const Index vertex = vertex_of(point, nodes);
    const Use use{-1, -1, cube, 0};
    use_nodes_.assign(1, nodes);
    anchor_vertex(cutter, vertex, point, {&use, 1});
    return vertex;
  }
  return -1;
}

/// Closes all loops by fans.
void CutSurface::close(const LatticeCutter& cutter) {
  sum_edges();
  if (open_edges_.empty()) return;
  std::vector<std::vector<Index>> loops = open_loops();
  const std::vector<Index> tips = tips_of(loops);
  for (std::size_t i = 0; i < loops.size(); ++i) {
    std::vector<Index>& loop = loops[i];
    const auto point = [&](Index v) { return vertex_point_[index(v)]; };
    auto first = std::find_if(loop.begin(), loop.end(), [&](Index v) { return point(v) == tips[i]; });
    const Index tip = first == loop.end() ? vertex_in(cutter, loop, tips[i]) : -1;
    if (first == loop.end())
      first =
          std::min_element(loop.begin(), loop.end(), [&](Index a, Index b) { return point(a) < point(b); });
    std::rotate(loop.begin(), first, loop.end());
    if (tip >= 0) {
      loop.push_back(loop.front());
      loop.insert(loop.begin(), tip);
    }
    if (!add_fan(cutter, loop)) return;
  }
}

/// From the first of some vertices. @returns whether there was capacity
bool CutSurface::add_fan(const LatticeCutter& cutter, std::span<const Index> way) {
  for (std::size_t v = 1; v + 1 < way.size(); ++v) {
    Triangle fill;
    fill.is_fill = true;
    const std::array<Index, 3> vertices{way[0], way[v], way[v + 1]};
    for (std::size_t k = 0; k < 3; ++k)
      fill.corner[k] = {vertex_point_[index(vertices[k])], vertex_cube_[index(vertices[k])]};
    const Index place = free_.empty() ? triangle_count() : free_.back();
    add_triangle(cutter, fill);
    if (place >= triangle_count()) return false;
    set_vertices(place, vertices);
    suspects_.push_back(place);
    ++filled_;
  }
  return true;
}

}  // namespace tactus::cut
