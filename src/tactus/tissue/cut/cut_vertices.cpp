// Vertices of a surface that is cut: which nodes move them, and that the surface stays closed.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {
namespace {

constexpr std::array<Index, 8> kAnyNodes{-1, -1, -1, -1, -1, -1, -1, -1};

}  // namespace

std::vector<Index> CutSurface::near_splits(const LatticeCutter& cutter,
                                           const std::vector<std::vector<CubeSplit>>& stages) {
  std::vector<Index> cubes;
  for (const auto& stage : stages) {
    for (const CubeSplit& split : stage) {
      const Vec3i p = cutter.lattice().cubes[index(cutter.regular_of(split.parent))];
      for (Index k = 0; k < 27; ++k)
        if (const Index cube = cutter.regular_at(p + Vec3i{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1}); cube >= 0)
          cubes.push_back(cube);
    }
  }
  std::sort(cubes.begin(), cubes.end());
  cubes.erase(std::unique(cubes.begin(), cubes.end()), cubes.end());
  std::vector<Index> triangles;
  seen_.resize(triangles_.size(), 0);
  for (const Index cube : cubes)
    for (const Index triangle : bins_[index(cube)])
      if (std::exchange(seen_[index(triangle)], 1) == 0) triangles.push_back(triangle);
  for (const Index triangle : triangles) seen_[index(triangle)] = 0;
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

/// Nodes that have a weight there, in the order of their places; -1 behind them.
std::array<Index, 8> CutSurface::nodes_of(const LatticeCutter& cutter, Corner corner) const {
  const Point& point = points_[index(corner.point)];
  std::array<Index, 8> nodes = kAnyNodes;
  if (!point.is_wall) return nodes;
  const CubeLattice& lattice = cutter.lattice();
  const Vec3i low = lattice.cubes[index(corner.cube)];
  std::size_t count = 0;
  for (int q = 0; q < 8; ++q) {
    bool has_weight = true;
    for (int a = 0; a < 3; ++a)
      has_weight =
          has_weight && (!is_whole(point.p[a]) || low[a] + (q >> a & 1) == static_cast<Index>(point.p[a]));
    if (has_weight) nodes[count++] = lattice.cube_nodes[index(corner.cube)][index(q)];
  }
  return nodes;
}

embed::Anchor CutSurface::anchor(const LatticeCutter& cutter, Index vertex) const {
  const Index point = vertex_point_[index(vertex)], cube = vertex_cube_[index(vertex)];
  if (!points_[index(point)].is_wall) return {cube, local_[index(point)]};
  return {cube, vec_cast<float>(at(point) - vec_cast<double>(cutter.lattice().cubes[index(cube)]))};
}

void CutSurface::count_edges(const std::array<Index, 3>& vertices, int sign) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Index a = vertices[k], b = vertices[(k + 1) % 3];
    if (a == b) continue;
    const std::uint64_t key = edge_key(a, b);
    int& sum = open_edges_[key];
    sum += a < b ? sign : -sign;
    if (sum == 0) open_edges_.erase(key);
  }
}

void CutSurface::set_vertices(Index triangle, std::array<Index, 3> vertices) {
  auto& now = vertices_of_[index(triangle)];
  if (now == vertices) return;
  count_edges(now, -1);
  count_edges(vertices, 1);
  now = vertices;
  new_triangles_.push_back(triangle);
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
  std::unordered_map<Index, Index> original;  // cube of original points that go elsewhere
  for (const Index triangle : triangles) {
    Triangle& t = triangles_[index(triangle)];
    if (t.is_fill || t.home >= 0) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      Corner& corner = t.corner[k];
      const Index p = t.corner[(k + 1) % 3].cube, q = t.corner[(k + 2) % 3].cube;
      if (agree(corner.cube, p) || agree(corner.cube, q) || !agree(p, q)) continue;
      for (const Index copy : cutter.live(cutter.regular_of(corner.cube)))
        if (agree(copy, p) && agree(copy, q)) corner.cube = copy;
      if (!points_[index(corner.point)].is_wall) original[corner.point] = corner.cube;
    }
  }
  if (original.empty()) return;
  for (const Index triangle : triangles)
    for (Corner& corner : triangles_[index(triangle)].corner)
      if (const auto other = original.find(corner.point); other != original.end())
        corner.cube = other->second;
}

/// In ascending order of points; of one point by nodes. Uses are counted per point, so points are sorted
/// alone.
std::vector<CutSurface::Use> CutSurface::uses_of(const LatticeCutter& cutter,
                                                 const std::vector<Index>& triangles) {
  uses_at_.resize(points_.size(), 0);
  std::vector<Index> points;
  const auto for_each_corner = [&](auto&& f) {
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const Triangle& t = triangles_[index(triangles[i])];
      for (std::size_t k = 0; k < 3 && !t.is_fill; ++k) f(i, k, t.corner[k]);
    }
  };
  for_each_corner([&](std::size_t, std::size_t, const Corner& corner) {
    if (uses_at_[index(corner.point)]++ == 0) points.push_back(corner.point);
  });
  std::sort(points.begin(), points.end());
  std::vector<Index> first;
  Index count = 0;
  for (const Index point : points) {
    first.push_back(count);
    count += std::exchange(uses_at_[index(point)], count);
  }
  first.push_back(count);
  std::vector<Use> uses(index(count));
  for_each_corner([&](std::size_t i, std::size_t k, const Corner& corner) {
    uses[index(uses_at_[index(corner.point)]++)] = {corner.point, i, static_cast<int>(k), corner.cube, {}};
  });
  for (const Index point : points) uses_at_[index(point)] = 0;
  tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t p) {
    const std::span<Use> here = std::span(uses).subspan(index(first[p]), index(first[p + 1] - first[p]));
    for (Use& use : here) use.nodes = nodes_of(cutter, {use.point, use.cube});
    // Most points are moved by the same nodes everywhere.
    const auto by_nodes = [](const Use& a, const Use& b) { return a.nodes < b.nodes; };
    if (!std::is_sorted(here.begin(), here.end(), by_nodes))
      std::stable_sort(here.begin(), here.end(), by_nodes);
  });
  return uses;
}

/// Of those known at the point, or one that is free, or a new one.
CutSurface::Vertex& CutSurface::vertex_of(const Use& use, std::vector<Vertex>& known) {
  const auto find = [&](const std::array<Index, 8>& nodes) {
    return std::find_if(known.begin(), known.end(), [&](const Vertex& v) { return v.nodes == nodes; });
  };
  auto vertex = find(use.nodes);
  if (vertex == known.end()) vertex = find(kAnyNodes);
  if (vertex == known.end()) {
    vertex = known.insert(known.end(), {kAnyNodes, vertex_count()});
    vertex_point_.push_back(use.point);
    vertex_cube_.push_back(-1);
  }
  vertex->nodes = use.nodes;
  return *vertex;
}

/// The vertex moves with a cube that has its nodes.
void CutSurface::anchor_vertex(const LatticeCutter& cutter, Index vertex, const Use& use) {
  const Index anchored = vertex_cube_[index(vertex)];
  const bool is_right =
      anchored >= 0 && cutter.lattice().cube_fill[index(anchored)] > 0 &&
      (use.point < static_cast<Index>(local_.size()) ? anchored == use.cube
                                                     : nodes_of(cutter, {use.point, anchored}) == use.nodes);
  if (is_right) return;
  vertex_cube_[index(vertex)] = use.cube;
  new_anchors_.push_back(vertex);
}

void CutSurface::name_vertices(const LatticeCutter& cutter, const std::vector<Index>& triangles) {
  const std::vector<Use> uses = uses_of(cutter, triangles);
  std::vector<std::array<Index, 3>> named(triangles.size(), {-1, -1, -1});
  std::vector<Vertex> original;
  for (std::size_t first = 0, end = 0; first < uses.size(); first = end) {
    while (end < uses.size() && uses[end].point == uses[first].point) ++end;
    const Index point = uses[first].point;
    const std::span<const Use> here = std::span(uses).subspan(first, end - first);
    original.assign(1, {kAnyNodes, point});
    std::vector<Vertex>& known = points_[index(point)].is_wall ? vertices_at_[point] : original;
    // Vertices whose nodes nobody has any more are free for the others.
    for (Vertex& v : known)
      if (std::none_of(here.begin(), here.end(), [&](const Use& use) { return use.nodes == v.nodes; }))
        v.nodes = kAnyNodes;
    for (const Use& use : here) {
      const Index vertex = vertex_of(use, known).vertex;
      named[use.triangle][index(use.corner)] = vertex;
      anchor_vertex(cutter, vertex, use);
    }
  }
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (!triangles_[index(triangles[i])].is_fill) set_vertices(triangles[i], named[i]);
}

/// Fills are made anew where something is cut.
void CutSurface::drop_fills(const std::vector<Index>& triangles) {
  for (const Index triangle : triangles) {
    if (!triangles_[index(triangle)].is_fill || vertices_of_[index(triangle)] == std::array<Index, 3>{})
      continue;
    set_vertices(triangle, {0, 0, 0});
    free_.push_back(triangle);
    --filled_;
  }
}

/// Edges that have no twin form loops, as a sum of triangles has no boundary's boundary. A loop is as small
/// as what rounding left open, and gets a fan of triangles.
void CutSurface::close(const LatticeCutter& cutter) {
  std::map<Index, std::vector<Index>> next;  // against the open edges
  for (const auto& [key, sum] : open_edges_) {
    const auto low = static_cast<Index>(key >> 32U), high = static_cast<Index>(key & 0xFFFFFFFFU);
    for (int k = 0; k < std::abs(sum); ++k) sum > 0 ? next[high].push_back(low) : next[low].push_back(high);
  }
  for (auto& [from, to] : next) std::sort(to.begin(), to.end());
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
      for (auto v = seen + 1; v != way.end() && v + 1 != way.end(); ++v) {
        Triangle fill;
        fill.is_fill = true;
        const std::array<Index, 3> vertices{*seen, *v, *(v + 1)};
        for (std::size_t k = 0; k < 3; ++k)
          fill.corner[k] = {vertex_point_[index(vertices[k])], vertex_cube_[index(vertices[k])]};
        const Index place = free_.empty() ? triangle_count() : free_.back();
        add_triangle(cutter, fill);
        if (place >= triangle_count()) return;
        set_vertices(place, vertices);
        ++filled_;
      }
      way.erase(seen + 1, way.end());
      if (!next.contains(way.back())) break;
    }
  }
}

void CutSurface::update(const LatticeCutter& cutter, const std::vector<std::vector<CubeSplit>>& stages,
                        TopologyChange& change) {
  const std::vector<Index> triangles = near_splits(cutter, stages);
  new_walls_ = std::exchange(next_walls_, {});
  new_splits_ = std::exchange(next_splits_, {});
  split_walls_ = std::exchange(next_split_walls_, {});
  new_anchors_.clear();
  new_triangles_.clear();
  drop_fills(triangles);
  mend_sides(cutter, triangles);
  name_vertices(cutter, triangles);
  close(cutter);
  for (auto* list : {&new_anchors_, &new_triangles_}) {
    std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
  for (const Index vertex : new_anchors_) {
    const embed::Anchor to = anchor(cutter, vertex);
    change.vertices.push_back({vertex, to.cube, to.local});
  }
  for (const Index triangle : new_triangles_)
    change.triangles.push_back({triangle, vertices_of_[index(triangle)]});
}

}  // namespace tactus::cut
