// Parts of the lattice that have more than one closed surface fall apart, so that each has one.
#include <algorithm>
#include <map>
#include <numeric>

#include "tactus/tissue/cut/cut_geometry.h"
#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {
namespace {

/// Samples of the surface of one piece of a cube's material, and of the others.
using Samples = std::array<std::vector<Vec3d>, 2>;

/// A plane with as many of the samples as it finds on their sides: a perceptron that keeps its best.
WallPlane plane_between(const Samples& samples) {
  std::array<Vec3d, 2> mean{};
  for (const std::size_t side : {0U, 1U})
    for (const Vec3d& p : samples[side]) mean[side] += p / static_cast<double>(samples[side].size());
  const Vec3d middle = 0.5 * (mean[0] + mean[1]);
  Vec3d normal = normalized(mean[1] - mean[0], Vec3d{1, 0, 0});
  double offset = 0;
  WallPlane best{middle, normal};
  std::size_t fewest = samples[0].size() + samples[1].size() + 1;
  constexpr int kRounds = 500;
  for (int round = 0; round < kRounds && fewest > 0; ++round) {
    const Vec3d before = normal;
    const double offset_before = offset;
    std::size_t wrong = 0;
    for (const std::size_t side : {0U, 1U})
      for (const Vec3d& p : samples[side]) {
        const double sign = side == 1 ? 1 : -1;
        wrong += sign * (dot(before, p - middle) + offset_before) > 0 ? 0 : 1;
        if (sign * (dot(normal, p - middle) + offset) > 0) continue;
        normal += sign * (p - middle);
        offset += sign;
      }
    if (wrong >= fewest || !(dot(before, before) > 0)) continue;
    fewest = wrong;
    best = {middle - offset_before / dot(before, before) * before, normalized(before, Vec3d{1, 0, 0})};
  }
  return best;
}

}  // namespace

CutSurface::ClosedPieces CutSurface::closed_pieces(const LatticeCutter& cutter) const {
  ClosedPieces found;
  std::vector<Index>& root_of = found.of_vertex;
  root_of.resize(index(vertex_count()));
  std::iota(root_of.begin(), root_of.end(), 0);
  const auto root = [&](Index v) {
    while (root_of[index(v)] != v) v = root_of[index(v)] = root_of[index(root_of[index(v)])];
    return v;
  };
  for (const auto& [a, b, c] : vertices_of_) root_of[index(root(a))] = root_of[index(root(b))] = root(c);
  for (Index v = 0; v < vertex_count(); ++v) root_of[index(v)] = root(v);
  const std::vector<Index> part_of_node = cutter.part_of_nodes();
  for (const Piece& t : vertices_of_) {
    if (!is_used(t)) continue;
    const Index first = root_of[index(t[0])];
    ClosedPiece& piece = found.pieces[first];
    if (piece.count++ == 0)
      piece.part = part_of_node[index(cutter.lattice().cube_nodes[index(vertex_cube_[index(first)])][0])];
    const auto p = [&](std::size_t k) { return at(vertex_point_[index(t[k])]); };
    piece.volume += volume6(at(vertex_point_[index(first)]), p(0), p(1), p(2)) / 6;
  }
  for (const auto& [first, piece] : found.pieces) {
    double& most = found.largest.try_emplace(piece.part, piece.volume).first->second;
    most = std::max(most, piece.volume);
  }
  return found;
}

std::span<const CutSurface::IslandCube> CutSurface::find_island(const LatticeCutter& cutter) {
  island_.clear();
  if (islands_ == 0) return {};
  const ClosedPieces all = closed_pieces(cutter);
  const auto island = std::find_if(all.pieces.begin(), all.pieces.end(), [&](const auto& piece) {
    return piece.second.volume >= kLeastFill && piece.second.volume != all.largest.at(piece.second.part);
  });
  islands_ = island != all.pieces.end() ? islands_ - 1 : 0;
  if (island == all.pieces.end()) return {};
  const auto is_of_island = [&](Index triangle) {
    return all.of_vertex[index(vertices_of_[index(triangle)][0])] == island->first;
  };
  std::vector<Index> cubes;
  for (Index triangle = 0; triangle < triangle_count(); ++triangle) {
    if (!is_used(vertices_of_[index(triangle)]) || !is_of_island(triangle)) continue;
    for (const Corner& corner : triangles_[index(triangle)].corner) cubes.push_back(corner.cube);
  }
  std::sort(cubes.begin(), cubes.end());
  cubes.erase(std::unique(cubes.begin(), cubes.end()), cubes.end());
  const auto is_deep = [&](Index cube) {
    std::size_t depth = 0;
    for (Index parent = cube; parent >= 0; parent = parent_[index(parent)]) ++depth;
    return depth + 8 >= kMostParents;
  };
  if (std::any_of(cubes.begin(), cubes.end(), is_deep)) return {};
  island_root_ = island->first;
  for (const Index cube : cubes) add_island_cube(cutter, cube, is_of_island);
  island_of_vertex_ = all.of_vertex;
  return island_;
}

template <class F>
void CutSurface::add_island_cube(const LatticeCutter& cutter, Index cube, const F& is_of_island) {
  constexpr int kSteps = 8;
  const Index regular = cutter.regular_of(cube);
  const Vec3i cell = cutter.lattice().cubes[index(cube)];
  const Vec3d low = vec_cast<double>(cell), high = low + Vec3d{1, 1, 1};
  Samples all;
  std::array<Samples, 6> of_tet;
  const Wall whole(cell, WallPlane{}, {0, 0, 0, 0, 0, 0});
  for (const Index triangle : bins_.of(regular)) {
    const Triangle& t = triangles_[index(triangle)];
    if (t.is_fill || !is_used(vertices_of_[index(triangle)]) || (t.home >= 0 && t.home != cube)) continue;
    const std::size_t side = is_of_island(triangle) ? 1 : 0;
    const Vec3d a = at(t.corner[0].point), b = at(t.corner[1].point), c = at(t.corner[2].point);
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; i + j <= kSteps; ++j) {
        const Vec3d p = a + (i * (b - a) + j * (c - a)) / double{kSteps};
        if (apart(p, p, low, high) || (t.home < 0 && leaf(regular, p) != cube)) continue;
        all[side].push_back(p);
        const int tet = t.home >= 0 ? t.tet : whole.tet_of(p);
        of_tet[index(tet)][side].push_back(p);
      }
  }
  IslandCube found{cube, all[0].empty(), {}};
  if (found.is_whole) {
    // Far away, where distances to it don't count.
    found.wall = Wall(cell, WallPlane{low - Vec3d{4, 0, 0}, {1, 0, 0}}, {1, 1, 1, 1, 1, 1});
  } else {
    std::array<int, 6> sides;
    for (std::size_t t = 0; t < 6; ++t)
      sides[t] = of_tet[t][0].empty() == of_tet[t][1].empty() ? -1 : of_tet[t][0].empty() ? 1 : 0;
    found.wall = Wall(cell, all[1].empty() ? WallPlane{low, {-1, 0, 0}} : plane_between(all), sides);
  }
  island_.push_back(found);
}

const std::vector<double>& CutSurface::part_island(const LatticeCutter& cutter,
                                                   const std::vector<CubeSplit>& stage) {
  Stage& s = stage_;
  s.clear();
  const std::size_t first_parted = parted_.size();
  s.splits.resize(stage.size());
  s.shares.resize(stage.size());
  s.found.resize(stage.size());
  s.is_sliver.assign(stage.size(), 0);
  s.empty_side.resize(stage.size());
  parted_.resize(first_parted + stage.size());
  for (std::size_t k = 0; k < stage.size(); ++k) {
    Split& split = s.splits[k];
    split = {};
    split.split = stage[k];
    split.regular = cutter.regular_of(stage[k].parent);
    Parted& parted = parted_[first_parted + k];
    parted = {island_[k].wall, {stage[k].part[0], stage[k].part[1]}, island_[k].is_whole ? 1 : -1};
    split.wall = &parted.wall;
    split.first_face = s.faces.size();
    for ([[maybe_unused]] const Index triangle : bins_.of(split.regular)) s.faces.emplace_back();
    find_reference(cutter, split);
    find_faces(s, split);
    find_share(cutter, s, k);
    if (island_[k].is_whole) s.shares[k] = s.found[k] = 1;
    s.is_sliver[k] = 0;
    const std::size_t first = next_split_walls_.size();
    const WallPlane& plane = parted.wall.parting(0).below;
    const Vec3d aside = std::abs(plane.normal.x) < 0.7 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0},
                along = cross(plane.normal, aside);
    next_split_walls_.push_back({plane.point, plane.point + along, plane.point + cross(plane.normal, along)});
    next_splits_.push_back({stage[k], first, next_split_walls_.size()});
    const Index regular_cubes = cutter.lattice().regular_cubes();
    if (stage[k].parent >= regular_cubes)
      for (const Index part : stage[k].part)
        ends_[index(part - regular_cubes)] = ends_[index(stage[k].parent - regular_cubes)];
  }
  part_cubes(s);
  note_slivers(cutter, s);
  take_to_island(s);
  return s.shares;
}

std::vector<std::array<Index, 2>> CutSurface::join_bare(const LatticeCutter& cutter) {
  if (!std::exchange(may_be_bare_, false)) return {};
  const CubeLattice& lattice = cutter.lattice();
  const std::vector<Index> part_of_node = cutter.part_of_nodes();
  const auto part = [&](Index cube) {
    return index(part_of_node[index(lattice.cube_nodes[index(cube)][0])]);
  };
  std::vector<std::uint8_t> has_surface(part_of_node.size());
  for (const Piece& t : vertices_of_)
    if (is_used(t)) has_surface[part(vertex_cube_[index(t[0])])] = 1;
  const auto counts = [&](Index cube) { return has_surface[part(cube)] != 0; };
  std::vector<std::array<Index, 2>> found;
  const Index first = lattice.regular_cubes();
  for (Index copy = first; copy < first + cutter.copies_in_use(); ++copy) {
    if (!(lattice.cube_fill[index(copy)] > 0) || counts(copy)) continue;
    const Across to = across(cutter, copy, counts);
    if (to.copy < 0) continue;
    parted_[to.wall].only = to.side;
    joined_[index(copy)] = to.copy;
    found.push_back({copy, to.copy});
  }
  if (!found.empty()) {  // the next change has no walls
    new_walls_.clear();
    new_splits_.clear();
    split_walls_.clear();
  }
  return found;
}

/// The lowest copy that counts across the wall that parted a cube last, or the wall before that.
template <class F>
CutSurface::Across CutSurface::across(const LatticeCutter& cutter, Index cube, const F& counts) const {
  const auto is_of = [&](Index copy, Index ancestor) {
    while (copy >= 0 && copy != ancestor) copy = parent_[index(copy)];
    return copy == ancestor;
  };
  for (Index below = cube, parent = parent_[index(cube)]; parent >= 0;
       below = parent, parent = parent_[index(parent)]) {
    const std::size_t wall = index(parted_place_[index(parent)]);
    const Parted& parted = parted_[wall];
    const int other = parted.part[0] == below ? 1 : 0;
    for (const Index copy : cutter.live(cutter.regular_of(cube)))
      if (cutter.lattice().cube_fill[index(copy)] > 0 && is_of(copy, parted.part[index(other)]) &&
          counts(copy))
        return {copy, wall, other};
  }
  return {};
}

/// All copies of a sliver go to copies of one other part, or none does.
std::vector<std::array<Index, 2>> CutSurface::join_slivers(const LatticeCutter& cutter) {
  std::vector<std::array<Index, 2>> found;
  std::vector<Index> part_of_node;
  const auto part = [&](Index cube) {
    return part_of_node[index(cutter.lattice().cube_nodes[index(cube)][0])];
  };
  std::vector<std::vector<Index>> slivers;
  std::vector<Index> sliver_parts;
  for (const Index copy : std::exchange(new_slivers_, {})) {
    std::vector<Index> copies = severed_sliver(cutter, copy);
    if (copies.empty()) continue;
    if (part_of_node.empty()) part_of_node = cutter.part_of_nodes();
    if (std::find(sliver_parts.begin(), sliver_parts.end(), part(copy)) != sliver_parts.end()) continue;
    sliver_parts.push_back(part(copy));
    slivers.push_back(std::move(copies));
  }
  for (const std::vector<Index>& copies : slivers) {
    Index of = -1;
    std::vector<Across> to;
    for (const Index copy : copies) {
      to.push_back(across(cutter, copy, [&](Index other) {
        return of >= 0
                   ? part(other) == of
                   : std::find(sliver_parts.begin(), sliver_parts.end(), part(other)) == sliver_parts.end();
      }));
      if (to.back().copy < 0) break;
      of = part(to.back().copy);
    }
    if (to.back().copy < 0) continue;
    for (std::size_t k = 0; k < copies.size(); ++k) {
      parted_[to[k].wall].only = to[k].side;
      joined_[index(copies[k])] = to[k].copy;
      held_[index(to[k].copy - cutter.lattice().regular_cubes())] +=
          std::exchange(held_[index(copies[k] - cutter.lattice().regular_cubes())], 0.0);
      found.push_back({copies[k], to[k].copy});
      add_near(cutter, copies[k]);
    }
  }
  if (found.empty()) return found;
  take_near();
  for (const auto& [from, to] : found) move_triangles(from, to);
  drop_shut_walls(found);
  is_cut_again_ = true;  // one whose wall isn't that of the part across hangs on nothing: it is dust
  return found;
}

/// Corners of triangles go to the copies of their own piece.
void CutSurface::take_to_island(const Stage& s) {
  std::map<Index, const CubeSplit*> split_of;
  for (const Split& split : s.splits) split_of[split.split.parent] = &split.split;
  for (Index triangle = 0; triangle < triangle_count(); ++triangle) {
    if (!is_used(vertices_of_[index(triangle)])) continue;
    Triangle& t = triangles_[index(triangle)];
    const int side = island_of_vertex_[index(vertices_of_[index(triangle)][0])] == island_root_ ? 1 : 0;
    const auto take = [&](Index& cube) {
      if (const auto split = split_of.find(cube); split != split_of.end()) cube = split->second->part[side];
    };
    for (Corner& corner : t.corner) take(corner.cube);
    if (t.home >= 0) take(t.home);
  }
}

}  // namespace tactus::cut
