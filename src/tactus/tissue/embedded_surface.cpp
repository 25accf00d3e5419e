#include "tactus/tissue/embedded_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <utility>

#include "tactus/base/at.h"
#include "tactus/base/error.h"
#include "tactus/tissue/embed_kernels.h"

namespace tactus {
namespace {

/// Which cube holds a point, or lies nearest to it.
class CubeFinder {
 public:
  explicit CubeFinder(const CubeLattice& lattice)
      : lattice_(lattice),
        dims_(lattice.node_dims - Vec3i{1, 1, 1}),
        id_(at(std::int64_t{dims_.x} * dims_.y * dims_.z), -1) {
    for (Index c = 0; c < lattice.regular_cubes(); ++c) id_[index(lattice.cubes[at(c)])] = c;
    for (std::size_t k = 0; k < lattice.copies.size(); ++k)
      if (lattice.copies[k].of >= 0) copies_.emplace(lattice.copies[k].of, k);
  }
  /// The cube itself or, if it was cut, its copy whose material a point in it lies nearest to.
  Index copy_at(Index cube, Vec3d local) const {
    const auto [begin, end] = copies_.equal_range(cube);
    if (begin == end) return cube;
    Index best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (auto copy = begin; copy != end; ++copy) {
      for (int q = 0; q < 8; ++q) {
        if ((lattice_.copies[copy->second].corners >> q & 1) == 0) continue;
        const Vec3d d = local - vec_cast<double>(Vec3i{q & 1, q >> 1 & 1, q >> 2});
        if (dot(d, d) >= least) continue;
        least = dot(d, d);
        best = lattice_.regular_cubes() + static_cast<Index>(copy->second);
      }
    }
    return best;
  }
  /// Cube and squared distance to it [spacings^2] of a point in lattice coordinates; cube -1: none within
  /// `reach` cubes.
  std::pair<Index, double> nearest(Vec3d p, int reach) const {
    const auto cell = [](double v, Index n) {
      return static_cast<Index>(std::clamp(std::floor(v), 0.0, double(n - 1)));
    };
    const Vec3i c{cell(p.x, dims_.x), cell(p.y, dims_.y), cell(p.z, dims_.z)};
    Index best = -1;
    double best_square = std::numeric_limits<double>::infinity();
    for (int ring = 0; ring <= reach && best_square > sqr(std::max(0.0, ring - 1.0)); ++ring) {
      const Vec3i low = max(c - Vec3i{ring, ring, ring}, Vec3i{}),
                  high = min(c + Vec3i{ring, ring, ring}, dims_ - Vec3i{1, 1, 1});
      for (Index z = low.z; z <= high.z; ++z)
        for (Index y = low.y; y <= high.y; ++y)
          for (Index x = low.x; x <= high.x; ++x) {
            const Index id = id_[index({x, y, z})];
            if (id < 0) continue;
            const Vec3d corner = vec_cast<double>(Vec3i{x, y, z});
            const Vec3d d = max(max(corner - p, p - corner - Vec3d{1, 1, 1}), Vec3d{});
            if (dot(d, d) < best_square) best_square = dot(d, d), best = id;
          }
    }
    return {best, best_square};
  }
  /// The wanted neighbour of a cell that is nearest to p, in lattice coordinates; -1: none.
  template <class F>
  Index nearest_around(Vec3i cell, Vec3d p, F&& is_wanted) const {
    const Vec3i low = max(cell - Vec3i{1, 1, 1}, Vec3i{}),
                high = min(cell + Vec3i{1, 1, 1}, dims_ - Vec3i{1, 1, 1});
    Index best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (Index z = low.z; z <= high.z; ++z)
      for (Index y = low.y; y <= high.y; ++y)
        for (Index x = low.x; x <= high.x; ++x) {
          const Index id = id_[index({x, y, z})];
          if (id < 0 || !is_wanted(id)) continue;
          const Vec3d d = p - (vec_cast<double>(Vec3i{x, y, z}) + Vec3d{0.5, 0.5, 0.5});
          if (dot(d, d) < least) least = dot(d, d), best = id;
        }
    return best;
  }

 private:
  std::size_t index(Vec3i p) const { return at((std::int64_t{p.z} * dims_.y + p.y) * dims_.x + p.x); }
  const CubeLattice& lattice_;
  Vec3i dims_;
  std::vector<Index> id_;
  std::multimap<Index, std::size_t> copies_;  ///< of regular cubes
};

/// In spacings: so far below a wall of a cut a point's side of it is looked up.
constexpr double kBelowSurface = 0.01;

/// Outward, unit; as many as vertices.
std::vector<Vec3f> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vec3f> normals(mesh.positions_m.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3f n = cross(mesh.positions_m[at(b)] - mesh.positions_m[at(a)],
                          mesh.positions_m[at(c)] - mesh.positions_m[at(a)]);
    for (const Index v : {a, b, c}) normals[at(v)] += n;
  }
  for (Vec3f& n : normals) n = normalized(n, Vec3f{});
  return normals;
}

}  // namespace

std::vector<embed::Anchor> anchor_points(const CubeLattice& lattice, std::span<const Vec3f> points_m,
                                         float max_outside, std::span<const Vec3f> outward) {
  const CubeFinder finder(lattice);
  std::vector<embed::Anchor> anchors(points_m.size());
  for (std::size_t v = 0; v < anchors.size(); ++v) {
    const Vec3f p = points_m[v];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      throw Error("surface vertex " + std::to_string(v) + " is not finite");
    const Vec3d q = (vec_cast<double>(p) - vec_cast<double>(lattice.origin_m)) / double{lattice.spacing_m};
    const auto [cube, square] = finder.nearest(q, static_cast<int>(std::ceil(max_outside)) + 2);
    if (cube < 0 || std::sqrt(square) > double{max_outside})
      throw Error("surface vertex " + std::to_string(v) + " at (" + number_text(double{p.x}) + ", " +
                  number_text(double{p.y}) + ", " + number_text(double{p.z}) + ") m is more than " +
                  number_text(double{max_outside}) +
                  " spacings away from all cubes: the mesh encloses nothing there; repair it");
    const Vec3d local = q - vec_cast<double>(lattice.cubes[at(cube)]),
                out = outward.empty() ? Vec3d{} : vec_cast<double>(outward[v]);
    anchors[v] = {finder.copy_at(cube, local - kBelowSurface * out), vec_cast<float>(local)};
  }
  return anchors;
}

std::vector<embed::Anchor> bearing_anchors(const CubeLattice& lattice, std::vector<embed::Anchor> anchors) {
  if (lattice.cube_fill.empty()) return anchors;
  const CubeFinder finder(lattice);
  for (embed::Anchor& anchor : anchors) {
    if (lattice.cube_fill[at(anchor.cube)] >= kBearingFill) continue;
    const Vec3i cell = lattice.cubes[at(anchor.cube)];
    const Vec3d p = vec_cast<double>(cell) + vec_cast<double>(anchor.local);
    const Index other =
        finder.nearest_around(cell, p, [&](Index c) { return lattice.cube_fill[at(c)] >= kBearingFill; });
    if (other < 0) continue;
    anchor = {other, vec_cast<float>(p - vec_cast<double>(lattice.cubes[at(other)]))};
  }
  return anchors;
}

std::vector<EmbeddedPoint> surface_points(const CubeLattice& lattice, const TriangleMesh& surface,
                                          float spacing_m, float max_outside) {
  const std::vector<SpreadPoint> points = spread_points(surface, spacing_m);
  std::vector<Vec3f> x_m;
  for (const SpreadPoint& point : points) x_m.push_back(point.x_m);
  return embed_points(lattice, points, bearing_anchors(lattice, anchor_points(lattice, x_m, max_outside)));
}

std::vector<EmbeddedPoint> embed_points(const CubeLattice& lattice, std::span<const SpreadPoint> points,
                                        std::span<const embed::Anchor> anchors) {
  std::vector<Index> cube;
  std::vector<Vec3f> local;
  for (const embed::Anchor& anchor : anchors) {
    cube.push_back(anchor.cube);
    local.push_back(anchor.local);
  }
  return embed_points(lattice, points, cube, local);
}

namespace {

std::vector<Index> flat_triangles(const TriangleMesh& mesh) {
  if (mesh.triangles.empty()) throw Error("surface has no triangles");
  const auto vertices = static_cast<Index>(mesh.positions_m.size());
  std::vector<Index> flat;
  flat.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const Index v : mesh.triangles[t]) {
      if (v < 0 || v >= vertices)
        throw Error("surface triangle " + std::to_string(t) + " uses vertex " + std::to_string(v) + " of " +
                    std::to_string(vertices));
      flat.push_back(v);
    }
  }
  return flat;
}

}  // namespace

std::vector<embed::Anchor> anchor_vertices(const CubeLattice& lattice, const TriangleMesh& mesh,
                                           float max_outside) {
  return anchor_points(lattice, mesh.positions_m, max_outside, vertex_normals(mesh));
}

EmbeddedSurface::EmbeddedSurface(ExecContext& ctx, const CubeLattice& lattice, const TriangleMesh& mesh,
                                 float max_outside, SurfaceCapacity capacity) {
  std::vector<Index> flat = flat_triangles(mesh);
  std::vector<embed::Anchor> anchors = anchor_vertices(lattice, mesh, max_outside);
  if (lattice.copies.empty()) anchors = bearing_anchors(lattice, std::move(anchors));
  std::vector<Vec3f> positions = mesh.positions_m;
  counts_ = {static_cast<Index>(positions.size()), static_cast<Index>(mesh.triangles.size())};
  positions.resize(at(std::max(capacity.vertices, counts_[0])));
  anchors.resize(positions.size());
  flat.resize(3 * at(std::max(capacity.triangles, counts_[1])));
  std::vector<embed::CubeNodes> cubes(lattice.cubes.size());
  for (std::size_t c = 0; c < cubes.size(); ++c)
    std::copy(lattice.cube_nodes[c].begin(), lattice.cube_nodes[c].end(), cubes[c].node);
  const auto vertices = static_cast<Index>(positions.size()), corners = static_cast<Index>(flat.size());
  device_counts_ = to_device(ctx, std::vector<Index>(counts_.begin(), counts_.end()));
  anchors_ = to_device(ctx, anchors);
  cubes_ = to_device(ctx, cubes);
  triangles_ = to_device(ctx, flat);
  positions_ = to_device(ctx, positions);
  normals_ = Buffer<Vec3f>(ctx.device(), vertices);
  std::vector<std::vector<Index>> of_vertex(at(vertices));
  for (Index t = 0; t < counts_[1]; ++t)
    for (const Index v : mesh.triangles[at(t)]) of_vertex[at(v)].push_back(t);
  incident_ = IndexLists(ctx, of_vertex, lattice.copies.empty() ? 0 : corners);
  gather_normals(ctx);
  ctx.synchronize();
  if (lattice.copies.empty()) return;
  host_triangles_ = mesh.triangles;
  host_triangles_.resize(at(corners) / 3);
  is_changed_.resize(host_triangles_.size());
  new_anchors_ = Buffer<SetValues<embed::Anchor>::Change>(ctx.device(), vertices);
  new_triangles_ = Buffer<embed::TriangleChange>(ctx.device(), corners / 3);
  new_cubes_ =
      Buffer<SetValues<embed::CubeNodes>::Change>(ctx.device(), static_cast<Index>(lattice.copies.size()));
  take_capacity_for_frame(ctx, std::min(lattice.copies.size() / 2, cut::kFrameSplits));
}

/// The lists' pages are in place when a frame first has so many cubes that fall apart, on the host and, where
/// a device is the host, there, too.
void EmbeddedSurface::take_capacity_for_frame(ExecContext& ctx, std::size_t splits) {
  const auto take = [&](auto& from, auto& to, std::size_t of_split) {
    from.resize(std::min(of_split * splits, at(to.size())));
    ctx.upload(from, to.view().part(0, static_cast<Index>(from.size())));
  };
  take(anchor_changes_, new_anchors_, 20);
  take(triangle_changes_, new_triangles_, 50);
  take(cube_changes_, new_cubes_, 4);
  cut::take_capacity(vertices_, 30 * splits);
  cut::take_capacity(first_added_, 30 * splits);
  cut::take_capacity(added_, 150 * splits);
  uses_at_.resize(at(positions_.size()));
  incident_.take_capacity(static_cast<Index>(150 * splits));
  ctx.synchronize();
}

/// Lists the triangles of each vertex of the changed triangles: ascending, so sums keep their order.
void EmbeddedSurface::list_triangles(std::span<const TopologyChange::Triangle> changes) {
  const auto is_used = [](const std::array<Index, 3>& t) { return t[0] != t[1] || t[1] != t[2]; };
  for (const TopologyChange::Triangle& change : changes) {
    auto& now = host_triangles_[at(change.triangle)];
    is_changed_[at(change.triangle)] = 1;
    for (const Index v : now) changed_vertices_.insert(v);
    now = change.vertices;
    for (const Index v : now) changed_vertices_.insert(v);
    if (is_used(now))
      for (const Index v : now) ++uses_at_[at(v)];
  }
  changed_vertices_.take(vertices_);
  first_added_.clear();
  Index count = 0;
  for (const Index vertex : vertices_) {
    first_added_.push_back(count);
    count += std::exchange(uses_at_[at(vertex)], count);
  }
  first_added_.push_back(count);
  added_.resize(at(count));
  for (const TopologyChange::Triangle& change : changes)
    if (is_used(change.vertices))
      for (const Index v : change.vertices) added_[at(uses_at_[at(v)]++)] = change.triangle;
  for (std::size_t k = 0; k < vertices_.size(); ++k) {
    list_.clear();
    for (const Index t : incident_[vertices_[k]])
      if (is_changed_[at(t)] == 0) list_.push_back(t);
    list_.insert(list_.end(), added_.begin() + first_added_[k], added_.begin() + first_added_[k + 1]);
    std::sort(list_.begin(), list_.end());
    incident_.set(vertices_[k], list_);
    uses_at_[at(vertices_[k])] = 0;
  }
  for (const TopologyChange::Triangle& change : changes) is_changed_[at(change.triangle)] = 0;
}

void EmbeddedSurface::gather_normals(ExecContext& ctx) {
  ctx.parallel_for("embed/normals", vertices(),
                   embed::GatherNormals{incident_.ranges(), incident_.values(), triangles_.const_view(),
                                        positions_.const_view(), normals_.view()});
}

void EmbeddedSurface::update(ExecContext& ctx, const BodyState& state) {
  ctx.parallel_for("embed/move", vertices(),
                   embed::MoveVertices{anchors_.const_view(), cubes_.const_view(), state.x_m.const_view(),
                                       positions_.view()});
  gather_normals(ctx);
}

void EmbeddedSurface::check(const TopologyChange& change) const {
  const auto require = [](Index id, Index capacity, const char* what) {
    if (id < 0 || id >= capacity)
      throw Error(std::string("cut surface: ") + what + " " + std::to_string(id) +
                  ", but there is capacity for " + std::to_string(capacity));
  };
  const auto capacity = [&](std::size_t count, Index most, const char* what) {
    if (count > at(most))
      throw Error("cut surface: " + std::to_string(count) + " " + what + ", but there is capacity for " +
                  std::to_string(most));
  };
  capacity(change.copies.size(), new_cubes_.size(), "copies");
  capacity(change.vertices.size(), new_anchors_.size(), "vertices");
  capacity(change.triangles.size(), new_triangles_.size(), "triangles");
  for (const TopologyChange::Copy& copy : change.copies) require(copy.cube, cubes_.size(), "cube");
  for (const TopologyChange::Vertex& v : change.vertices) {
    require(v.vertex, positions_.size(), "vertex");
    require(v.cube, cubes_.size(), "cube");
  }
  for (const TopologyChange::Triangle& t : change.triangles) {
    require(t.triangle, triangles_.size() / 3, "triangle");
    for (const Index v : t.vertices) require(v, positions_.size(), "vertex");
  }
}

void EmbeddedSurface::apply(ExecContext& ctx, const TopologyChange& change) {
  check(change);
  cube_changes_.clear();
  for (const TopologyChange::Copy& copy : change.copies) {
    cube_changes_.push_back({copy.cube, {}});
    std::copy(copy.nodes.begin(), copy.nodes.end(), cube_changes_.back().value.node);
  }
  anchor_changes_.clear();
  for (const TopologyChange::Vertex& v : change.vertices) {
    anchor_changes_.push_back({v.vertex, {v.cube, v.local}});
    counts_[0] = std::max(counts_[0], v.vertex + 1);
  }
  triangle_changes_.clear();
  for (const TopologyChange::Triangle& t : change.triangles) {
    triangle_changes_.push_back({t.triangle, {t.vertices[0], t.vertices[1], t.vertices[2]}});
    counts_[1] = std::max(counts_[1], t.triangle + 1);
  }
  ctx.upload(std::span<const Index>(counts_), device_counts_.view());
  const auto put = [&]<class T>(const std::vector<T>& from, Buffer<T>& to) {
    const View<T> part = to.view().part(0, static_cast<Index>(from.size()));
    ctx.upload(std::span<const T>(from), part);
    return View<const T>(part);
  };
  const auto of_cubes = put(cube_changes_, new_cubes_);
  const auto of_vertices = put(anchor_changes_, new_anchors_);
  const auto of_triangles = put(triangle_changes_, new_triangles_);
  ctx.parallel_for("embed/set_cubes", of_cubes.size(), SetValues<embed::CubeNodes>{of_cubes, cubes_.view()});
  ctx.parallel_for("embed/set_anchors", of_vertices.size(),
                   SetValues<embed::Anchor>{of_vertices, anchors_.view()});
  ctx.parallel_for("embed/set_triangles", of_triangles.size(),
                   embed::SetTriangles{of_triangles, triangles_.view()});
  list_triangles(change.triangles);
  incident_.upload(ctx);
  ctx.synchronize();
}

TriangleMesh EmbeddedSurface::to_mesh(ExecContext& ctx) const {
  TriangleMesh mesh;
  mesh.positions_m = to_host(ctx, positions_m());
  mesh.normals = to_host(ctx, normals());
  const std::vector<Index> flat = to_host(ctx, triangles());
  mesh.triangles.resize(flat.size() / 3);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    mesh.triangles[t] = {flat[3 * t], flat[3 * t + 1], flat[3 * t + 2]};
  return mesh;
}

}  // namespace tactus
