// Vertices of a surface that is cut: which nodes move them.
#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "tactus/compute/cpu_for.h"
#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {
namespace {

bool same(const std::array<Index, 8>& a, const std::array<Index, 8>& b) {
  Index differ = 0;
  for (std::size_t k = 0; k < 8; ++k) differ |= a[k] ^ b[k];
  return differ == 0;
}

constexpr std::array<Index, 8> kAnyNodes{-1, -1, -1, -1, -1, -1, -1, -1};

}  // namespace

/// Per cube that falls apart, as much as cubes at the surface need.
void CutSurface::take_capacity_for_frame(std::size_t splits) {
  const auto more = [&](auto& list, std::size_t of_split) {
    take_capacity(list, list.size() + of_split * splits);
  };
  more(triangles_, 50);
  more(vertices_of_, 50);
  more(points_, 20);
  more(parted_, 1);
  bins_.take_capacity_for(0, 150 * splits);
  vertices_at_.take_capacity_for(points_.size() + 20 * splits, 20 * splits);
  more(vertex_point_, 20);
  more(vertex_cube_, 20);
  more(next_walls_, 20);
  more(new_walls_, 20);
  more(next_split_walls_, 12);
  more(wall_middles_, 12);
  more(run_depths_, 1);
  more(split_walls_, 12);
  more(changes_, 60);
  more(open_edges_, 100);
  more(edge_table_, 256);
  more(uses_, 100);
  more(use_nodes_, 100);
  more(use_points_, 20);
  more(first_use_, 20);
  more(new_anchors_, 20);
  more(new_triangles_, 50);
  take_capacity(uses_at_, points_.size() + 20 * splits);
  more(near_, 60);
  more(named_, 60);
  more(weight_changes_, 60);
  more(is_mended_, 60);
  take_capacity_for_stage(splits);
}

/// Where all cubes of a stage are at the surface, lists grow: few of them are.
void CutSurface::take_capacity_for_stage(std::size_t splits) {
  Stage& s = stage_;
  take_capacity(s.splits, splits);
  take_capacity(s.walls, 12 * splits);
  take_capacity(s.faces, 20 * splits);
  take_capacity(s.near, 20 * splits);
  s.on_edge.take_capacity_for(4 * splits);
  s.crossings.reserve(4 * splits);
  s.rim.reserve(4 * splits);
  s.parents.take_capacity_for(4 * splits, 8 * splits);
  s.segments.take_capacity_for(20 * splits, 4 * splits);
  s.wall_segments.take_capacity_for(12 * splits, 4 * splits);
  take_capacity(s.shares, splits);
  take_capacity(s.found, splits);
  take_capacity(new_slivers_, splits);
  take_capacity(s.is_sliver, splits);
  take_capacity(s.empty_side, splits);
  take_capacity(s.near_pieces, 20 * splits);
  take_capacity(s.wall_pieces, 12 * splits);
  take_capacity(next_splits_, splits);
  take_capacity(new_splits_, splits);
  take_capacity(at_surface_, splits);
  take_capacity(dividing_, 4 * splits);
  divided_.resize(std::max(divided_.size(), 2 * splits));
  meetings_.resize(std::max(meetings_.size(), splits / 2));
  for (auto& of_split : meetings_) take_capacity(of_split, 24);
}

void CutSurface::find_near_splits(const LatticeCutter& cutter,
                                  std::span<const std::vector<CubeSplit>> stages) {
  for (const auto& stage : stages)
    for (const CubeSplit& split : stage) add_near(cutter, split.parent);
  take_near();
}

/// Into set_: cubes with triangles, round a cube.
void CutSurface::add_near(const LatticeCutter& cutter, Index cube) {
  const Vec3i p = cutter.lattice().cubes[index(cutter.regular_of(cube))];
  for (Index k = 0; k < 27; ++k)
    if (const Index near = cutter.regular_at(p + Vec3i{k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1});
        near >= 0 && !bins_.empty(near))
      set_.insert(near);
}

void CutSurface::take_near() {
  set_.take(near_cubes_);
  for (const Index cube : near_cubes_)
    for (const Index triangle : bins_.of(cube)) set_.insert(triangle);
  set_.take(near_);
}

/// Nodes that have a weight there, in the order of their places; -1 behind them.
std::array<Index, 8> CutSurface::nodes_of(const LatticeCutter& cutter, Corner corner) const {
  const Point& point = points_[index(corner.point)];
  std::array<Index, 8> nodes = kAnyNodes;
  if (!point.is_wall) return nodes;
  constexpr std::array<unsigned, 3> kHigh{0xAA, 0xCC, 0xF0};  // corners
  const CubeLattice& lattice = cutter.lattice();
  const Vec3i low = lattice.cubes[index(corner.cube)];
  unsigned corners = 0xFF;
  for (int a = 0; a < 3; ++a) {
    if (!is_whole(point.p[a])) continue;
    const Index side = static_cast<Index>(point.p[a]) - low[a];
    corners &= side == 0 ? ~kHigh[index(a)] : side == 1 ? kHigh[index(a)] : 0U;
  }
  std::size_t count = 0;
  for (; corners != 0; corners &= corners - 1)
    nodes[count++] = lattice.cube_nodes[index(corner.cube)][index(std::countr_zero(corners))];
  return nodes;
}

embed::Anchor CutSurface::anchor(const LatticeCutter& cutter, Index vertex) const {
  const Index point = vertex_point_[index(vertex)], cube = vertex_cube_[index(vertex)];
  if (!points_[index(point)].is_wall) return {cube, local_[index(point)]};
  return {cube, vec_cast<float>(at(point) - vec_cast<double>(cutter.lattice().cubes[index(cube)]))};
}

/// Sum over its directed edges, each of a random weight whose twin has the opposite one.
std::uint64_t CutSurface::edge_weight(const std::array<Index, 3>& vertices) {
  std::uint64_t sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Index a = vertices[k], b = vertices[(k + 1) % 3];
    const std::uint64_t weight = mixed(edge_key(a, b));
    sum += a < b ? weight : a > b ? -weight : 0;
  }
  return sum;
}

void CutSurface::count_edges(const std::array<Index, 3>& vertices, int sign) {
  for (std::size_t k = 0; k < 3; ++k) {
    const Index a = vertices[k], b = vertices[(k + 1) % 3];
    if (a != b) open_edges_.push_back({edge_key(a, b), a < b ? sign : -sign});
  }
}

/// One entry per edge whose sum is not 0 remains. Nearly always all sums are 0. Then their weighted sum is,
/// which others are with a probability of 2^-64.
void CutSurface::sum_edges() {
  const bool is_closed = edge_weight_ == 0 && open_edges_.empty();
  for (const VertexChange& change : changes_) {
    if (is_closed) break;
    count_edges(change.before, -1);
    count_edges(change.after, 1);
  }
  changes_.clear();
  edge_weight_ = 0;
  if (is_closed) return;
  edge_table_.assign(std::bit_ceil(2 * open_edges_.size() + 1), EdgeSum{});
  const std::size_t mask = edge_table_.size() - 1;
  for (const EdgeSum& change : open_edges_) {
    std::size_t i = hash_of(change.edge) & mask;
    while (edge_table_[i].edge != 0 && edge_table_[i].edge != change.edge) i = (i + 1) & mask;
    edge_table_[i].edge = change.edge;  // 0 is no edge: its ends would be one vertex
    edge_table_[i].sum += change.sum;
  }
  open_edges_.clear();
  for (const EdgeSum& edge : edge_table_)
    if (edge.sum != 0) open_edges_.push_back(edge);
}

/// @param change of edge_weight_
void CutSurface::set_vertices(Index triangle, const std::array<Index, 3>& vertices, std::uint64_t change) {
  auto& now = vertices_of_[index(triangle)];
  if (now == vertices) return;
  changes_.push_back({now, vertices});
  edge_weight_ += change;
  now = vertices;
  new_triangles_.push_back(triangle);
}

/// In ascending order of points; of one point by nodes. Uses are counted per point, so points are sorted
/// alone.
void CutSurface::find_uses(const LatticeCutter& cutter, const std::vector<Index>& triangles) {
  uses_at_.resize(points_.size(), 0);
  const auto for_each_corner = [&](auto&& f) {
    for (std::size_t i = 0; i < triangles.size(); ++i) {
      const Triangle& t = triangles_[index(triangles[i])];
      for (Index k = 0; k < 3 && !t.is_fill; ++k) f(static_cast<Index>(i), k, t.corner[index(k)]);
    }
  };
  for_each_corner([&](Index, Index, const Corner& corner) {
    if (uses_at_[index(corner.point)]++ == 0) set_.insert(corner.point);
  });
  set_.take(use_points_);
  first_use_.clear();
  Index count = 0;
  for (const Index point : use_points_) {
    first_use_.push_back(count);
    count += std::exchange(uses_at_[index(point)], count);
  }
  first_use_.push_back(count);
  uses_.resize(index(count));
  use_nodes_.resize(index(count));
  for_each_corner([&](Index i, Index k, const Corner& corner) {
    uses_[index(uses_at_[index(corner.point)]++)] = {i, k, corner.cube, 0};
  });
  for (const Index point : use_points_) uses_at_[index(point)] = 0;
  cpu_for(use_points_.size(), 64, [&](std::size_t p) {
    const auto first = index(first_use_[p]);
    sort_by_nodes(cutter, use_points_[p], std::span(uses_).subspan(first, index(first_use_[p + 1]) - first),
                  first);
  });
}

/// Uses with the same nodes have them at the same place. @param first place of the first use in uses_
void CutSurface::sort_by_nodes(const LatticeCutter& cutter, Index point, std::span<Use> here,
                               std::size_t first) {
  ShortList<std::array<Index, 2>, 16> cubes;  // and which nodes they have
  ShortList<Index, 8> kinds;                  // of nodes, ascending
  for (Use& use : here) {
    std::size_t k = cubes.size();
    while (k > 0 && cubes[k - 1][0] != use.cube) --k;
    if (k == 0) {
      const std::array<Index, 8> nodes = nodes_of(cutter, {point, use.cube});
      const auto of = [&](Index kind) -> const auto& { return use_nodes_[first + index(kind)]; };
      auto kind = static_cast<Index>(kinds.size());
      const auto known =
          std::find_if(kinds.begin(), kinds.end(), [&](Index i) { return same(of(i), nodes); });
      if (known == kinds.end()) {
        use_nodes_[first + index(kind)] = nodes;
        kinds.push_back(kind);
        for (std::size_t i = kinds.size() - 1; i > 0 && nodes < of(kinds[i - 1]); --i)
          std::swap(kinds[i], kinds[i - 1]);
      } else {
        kind = *known;
      }
      cubes.push_back({use.cube, kind});
      k = cubes.size();
    }
    use.nodes = first + index(cubes[k - 1][1]);
  }
  if (kinds.size() < 2) return;  // most points are moved by the same nodes everywhere
  ShortList<Use, 32> unsorted;
  unsorted.append(here.begin(), here.end());
  std::size_t to = 0;
  for (const Index kind : kinds)
    for (const Use& use : unsorted)
      if (use.nodes == first + index(kind)) here[to++] = use;
}

/// A vertex known at the point, or one that is free, or a new one.
Index CutSurface::vertex_of(Index point, const std::array<Index, 8>& nodes) {
  Vertex* free = nullptr;
  for (Vertex& v : vertices_at_.of(point)) {
    if (same(v.nodes, nodes)) return v.vertex;
    if (free == nullptr && v.nodes[0] == kAnyNodes[0]) free = &v;
  }
  if (free == nullptr) {
    free = &vertices_at_.push_back(point, {kAnyNodes, vertex_count()});
    vertex_point_.push_back(point);
    vertex_cube_.push_back(-1);
  }
  free->nodes = nodes;
  return free->vertex;
}

/// The vertex moves with a cube that has its nodes. @param uses with the same nodes
void CutSurface::anchor_vertex(const LatticeCutter& cutter, Index vertex, Index point,
                               std::span<const Use> uses) {
  const bool is_original = point < static_cast<Index>(local_.size());
  for (std::size_t k = 0; k < uses.size(); ++k) {
    if (k > 0 && uses[k].cube == uses[k - 1].cube) continue;
    const Index anchored = vertex_cube_[index(vertex)];
    const bool is_right = anchored >= 0 && cutter.lattice().cube_fill[index(anchored)] > 0 &&
                          (anchored == uses[k].cube ||
                           (!is_original && same(nodes_of(cutter, {point, anchored}), nodes_of(uses[k]))));
    if (is_right) continue;
    vertex_cube_[index(vertex)] = uses[k].cube;
    new_anchors_.push_back(vertex);
  }
}

/// Whether all triangles that have a point are looked at now: those in a cube that holds it. Triangles that
/// were divided are in more cubes' lists than they meet, so some are looked at without their neighbours.
bool CutSurface::knows_all_at(const LatticeCutter& cutter, Vec3d p) const {
  constexpr double kMargin = 1e-5;  // less than that of lists
  for (int q = 0; q < 8; ++q) {
    Vec3i cell;
    for (int a = 0; a < 3; ++a)
      cell[a] = static_cast<Index>(std::floor(p[a] + ((q >> a & 1) != 0 ? kMargin : -kMargin)));
    const Index cube = cutter.regular_at(cell);
    if (cube >= 0 && std::binary_search(near_cubes_.begin(), near_cubes_.end(), cube)) return true;
  }
  return false;
}

void CutSurface::name_point(const LatticeCutter& cutter, Index point, std::span<const Use> here) {
  const bool is_wall = points_[index(point)].is_wall;
  const auto end_of = [&](std::size_t first) {
    std::size_t end = first;
    while (end < here.size() && here[end].nodes == here[first].nodes) ++end;
    return end;
  };
  // Vertices whose nodes no corner has any more are free for the others.
  if (is_wall) {
    for (Vertex& v : vertices_at_.of(point)) {
      std::size_t first = 0;
      while (first < here.size() && !same(nodes_of(here[first]), v.nodes)) first = end_of(first);
      if (first == here.size() && v.nodes != kAnyNodes && knows_all_at(cutter, at(point)))
        v.nodes = kAnyNodes;
    }
  }
  for (std::size_t first = 0, end = 0; first < here.size(); first = end) {
    end = end_of(first);
    const std::span<const Use> same = here.subspan(first, end - first);
    const Index vertex = is_wall ? vertex_of(point, nodes_of(same.front())) : point;
    for (const Use& use : same) named_[index(use.triangle)][index(use.corner)] = vertex;
    anchor_vertex(cutter, vertex, point, same);
  }
}

void CutSurface::name_vertices(const LatticeCutter& cutter, const std::vector<Index>& triangles) {
  find_uses(cutter, triangles);
  vertices_at_.resize(static_cast<Index>(points_.size()));
  named_.assign(triangles.size(), {-1, -1, -1});
  for (std::size_t p = 0; p < use_points_.size(); ++p) {
    const auto first = index(first_use_[p]);
    name_point(cutter, use_points_[p],
               std::span<const Use>(uses_).subspan(first, index(first_use_[p + 1]) - first));
  }
  weight_changes_.resize(triangles.size());
  cpu_for(triangles.size(), 256, [&](std::size_t i) {
    if (triangles_[index(triangles[i])].is_fill) named_[i] = vertices_of_[index(triangles[i])];  // they stay
    weight_changes_[i] = weight_change(triangles[i], named_[i]);
  });
  for (std::size_t i = 0; i < triangles.size(); ++i)
    set_vertices(triangles[i], named_[i], weight_changes_[i]);
}

void CutSurface::update(const LatticeCutter& cutter, TopologyChange& change) {
  const std::vector<Index>& triangles = near_;
  const auto take = [](auto& now, auto& next) {
    std::swap(now, next);
    next.clear();
  };
  take(new_walls_, next_walls_);
  take(new_splits_, next_splits_);
  take(split_walls_, next_split_walls_);
  new_anchors_.clear();
  new_triangles_.clear();
  drop_fills(cutter, triangles);
  mend_sides(cutter, triangles);
  name_vertices(cutter, triangles);
  note_suspects(triangles);
  separate(cutter);
  close(cutter);
  if (std::exchange(is_cut_again_, false)) drop_dust(cutter);
  for (auto* list : {&new_anchors_, &new_triangles_}) {
    if (!std::is_sorted(list->begin(), list->end())) std::sort(list->begin(), list->end());
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
