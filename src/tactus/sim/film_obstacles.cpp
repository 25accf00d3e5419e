#include "tactus/sim/film_obstacles.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tactus/base/error.h"
#include "tactus/fluid/film/film_kernels.h"
#include "tactus/geom/mesh/bisect_edges.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/sim/still_obstacles.h"
#include "tactus/sim/still_solids.h"

namespace tactus {
namespace {

/// So many parts of the longest edge: squares then, not slivers, are bisected.
constexpr float kPartsOfEdge = 16;
/// A film's edge is some 1 mm wide, as high as a triangle whose longest edge is this.
constexpr float kLeastEdge_m = 0.002F;

Index pieces_of(float edge_m, float longest_m) {
  return std::max<Index>(1, static_cast<Index>(std::lround(kPartsOfEdge * edge_m / longest_m)));
}

/// The part of a plane in whose shadow a box lies, in the plane's coordinates: y is its height.
TriangleMesh plane_surface(const Rigidf& T_world_plane, const Box3f& box_m) {
  const Rigidf T_plane_world = inverse(T_world_plane);
  Vec3f low{1e30F, 1e30F, 1e30F}, high = -1.F * low;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3f p = T_plane_world * Vec3f{(corner & 1) != 0 ? box_m.min.x : box_m.max.x,
                                          (corner & 2) != 0 ? box_m.min.y : box_m.max.y,
                                          (corner & 4) != 0 ? box_m.min.z : box_m.max.z};
    low = min(low, p), high = max(high, p);
  }
  const Vec3f edge = high - low;
  const float longest_m = std::max(edge.x, edge.z);
  const Index nx = pieces_of(edge.x, longest_m), nz = pieces_of(edge.z, longest_m);
  TriangleMesh mesh;
  for (Index j = 0; j <= nz; ++j)
    for (Index i = 0; i <= nx; ++i)
      mesh.positions_m.push_back({low.x + edge.x * static_cast<float>(i) / static_cast<float>(nx), 0,
                                  low.z + edge.z * static_cast<float>(j) / static_cast<float>(nz)});
  for (Index j = 0; j < nz; ++j)
    for (Index i = 0; i < nx; ++i) {
      const Index a = j * (nx + 1) + i, b = a + 1, c = a + nx + 1, d = c + 1;
      mesh.triangles.push_back({a, c, d});
      mesh.triangles.push_back({a, d, b});
    }
  return mesh;
}

/// In the world, but that of one that moves in its own coordinates.
TriangleMesh coarse_surface(const ObstacleDescription& o, const Box3f& box_m) {
  const float longest_m = std::max({o.half_m.x, o.half_m.y, o.half_m.z});
  TriangleMesh mesh =
      o.kind == ObstacleKind::plane ? plane_surface(o.T_world_obstacle, box_m)
      : o.kind == ObstacleKind::box
          ? box_surface(o.half_m, {pieces_of(o.half_m.x, longest_m), pieces_of(o.half_m.y, longest_m),
                                   pieces_of(o.half_m.z, longest_m)})
          : o.mesh;
  if (!o.moves)
    for (Vec3f& p : mesh.positions_m) p = o.T_world_obstacle * p;
  return mesh;
}

bool overlap(const Box3f& a, const Box3f& b) {
  const Vec3f apart = max(a.min - b.max, b.min - a.max);
  return std::max({apart.x, apart.y, apart.z}) < 0;
}

}  // namespace

FilmThickness film_thickness(const std::vector<Vec3f>& x_m,
                             const std::vector<std::array<Index, 3>>& triangles,
                             const std::vector<std::int64_t>& film, const std::vector<std::int64_t>& stain) {
  std::vector<float> third_m2(x_m.size());
  for (const auto& t : triangles) {
    const auto x = [&](std::size_t k) { return x_m[static_cast<std::size_t>(t.at(k))]; };
    const float area_m2 = length(cross(x(1) - x(0), x(2) - x(0))) / 6;
    for (const Index v : t) third_m2[static_cast<std::size_t>(v)] += area_m2;
  }
  const auto over_area = [&](const std::vector<std::int64_t>& units) {
    std::vector<float> all(third_m2.size());
    for (std::size_t v = 0; v < all.size(); ++v)
      if (third_m2[v] > 0) all[v] = kFilmUnit_m3 * static_cast<float>(units[v]) / third_m2[v];
    return all;
  };
  return {over_area(film), over_area(stain)};
}

WetObstacle FilmObstacles::Part::where_wet(const std::vector<std::int64_t>& film,
                                           const std::vector<std::int64_t>& stain) const {
  constexpr int kRings = 1;  // and the triangles round those
  WetObstacle wet;
  if (std::all_of(film.begin(), film.end(), [](std::int64_t u) { return u == 0; }) &&
      std::all_of(stain.begin(), stain.end(), [](std::int64_t u) { return u == 0; }))
    return wet;
  std::vector<std::int64_t> film_of(mesh.positions_m.size()), stain_of = film_of;
  std::vector<std::uint8_t> is_near(mesh.positions_m.size());
  for (std::size_t k = 0; k < vertices.size(); ++k) {
    const auto v = static_cast<std::size_t>(vertices[k]);
    film_of[v] = film[k], stain_of[v] = stain[k];
    is_near[v] = film[k] > 0 || stain[k] > 0 ? 1 : 0;
  }
  const auto any = [&](const std::array<Index, 3>& t) {
    return std::any_of(t.begin(), t.end(),
                       [&](Index v) { return is_near[static_cast<std::size_t>(v)] != 0; });
  };
  for (int ring = 0; ring < kRings; ++ring) {
    std::vector<std::uint8_t> wider = is_near;
    for (const auto& t : triangles)
      if (any(t))
        for (const Index v : t) wider[static_cast<std::size_t>(v)] = 1;
    is_near = std::move(wider);
  }
  const FilmThickness lies = film_thickness(mesh.positions_m, triangles, film_of, stain_of);
  std::vector<Index> number(mesh.positions_m.size(), -1);
  const auto numbered = [&](Index v) {
    const auto at = static_cast<std::size_t>(v);
    if (number[at] < 0) {
      number[at] = static_cast<Index>(wet.mesh.positions_m.size());
      wet.mesh.positions_m.push_back(mesh.positions_m[at]);
      wet.mesh.normals.push_back(mesh.normals[at]);
      wet.film.film_m.push_back(lies.film_m[at]);
      wet.film.stain_m.push_back(lies.stain_m[at]);
    }
    return number[at];
  };
  for (const auto& t : triangles)
    if (any(t)) wet.mesh.triangles.push_back({numbered(t[0]), numbered(t[1]), numbered(t[2])});
  wet.name = name;
  return wet;
}

FilmObstacles::FilmObstacles(ExecContext& ctx, std::span<const ObstacleDescription> obstacles,
                             const Box3f& box_m, bool has_floor, float spacing_m,
                             std::vector<Notice>& notices)
    : edge_m_(std::max(spacing_m, kLeastEdge_m)) {
  const StillSolids solids({}, obstacles);
  const float touch_m = 0.1F * spacing_m;
  const Vec3f more = 0.25F * spacing_m * Vec3f{1, 1, 1};
  const Box3f wet_m{box_m.min - more, box_m.max + more};
  const auto can_be_wet = [&](const ObstacleDescription& o, Vec3f x_m) {
    const Vec3f out = max(wet_m.min - x_m, x_m - wet_m.max);
    const bool is_on_floor = has_floor && o.kind != ObstacleKind::plane && x_m.y < box_m.min.y + touch_m;
    return o.moves || (std::max({out.x, out.y, out.z}) < 0 && !is_on_floor && !solids.hold(x_m, touch_m, &o));
  };
  ObstacleDescription floor;
  floor.name = kLiquidFloorName;
  floor.T_world_obstacle.t = {0, box_m.min.y, 0};
  Index moving = 0;
  const auto lay = [&](const ObstacleDescription& o) {
    Part part;
    part.name = o.name;
    part.moving = o.moves ? moving++ : -1;
    if (refine(o, wet_m, part, [&](Vec3f x_m) { return can_be_wet(o, x_m); }))
      add(o, std::move(part));
    else
      notices.push_back({"liquid.film_full", Severity::warning,
                         (&o == &floor ? "the " + o.name : "obstacle '" + o.name + "'") +
                             " has no film: obstacles would need more than " + std::to_string(kMostVertices) +
                             " vertices in 'fluid.box', one each " +
                             number_text(std::round(1e4 * double{edge_m_}) / 1e4) + " m",
                         "raise 'fluid.spacing_m', make 'fluid.box' or the obstacle smaller, or say "
                         "'fluid.film: false'"});
  };
  for (const ObstacleDescription& o : obstacles) lay(o);
  if (has_floor) lay(floor);
  if (!empty()) take_to_device(ctx);
}

/// Fills in the part's surface. @returns whether there is capacity for its vertices
bool FilmObstacles::refine(const ObstacleDescription& obstacle, const Box3f& wet_m, Part& part,
                           const std::function<bool(Vec3f)>& can_be_wet) const {
  const std::size_t left = kMostVertices - x_m_.size();
  TriangleMesh coarse = coarse_surface(obstacle, wet_m);
  const std::size_t most = coarse.positions_m.size() + left;
  std::optional<TriangleMesh> fine = bisect_edges(
      std::move(coarse), edge_m_, [&](const Box3f& box) { return obstacle.moves || overlap(box, wet_m); },
      most);
  if (!fine) return false;
  part.mesh = std::move(*fine);
  compute_normals(part.mesh);
  std::vector<std::uint8_t> is_wet(part.mesh.positions_m.size());
  for (const auto& t : part.mesh.triangles) {
    Vec3f middle_m{};
    for (const Index v : t) middle_m += (1.F / 3) * part.mesh.positions_m[static_cast<std::size_t>(v)];
    if (!can_be_wet(middle_m)) continue;
    part.triangles.push_back(t);
    for (const Index v : t) is_wet[static_cast<std::size_t>(v)] = 1;
  }
  for (std::size_t v = 0; v < is_wet.size(); ++v)
    if (is_wet[v] != 0) part.vertices.push_back(static_cast<Index>(v));
  return part.vertices.size() <= left;
}

void FilmObstacles::add(const ObstacleDescription& obstacle, Part part) {
  if (part.triangles.empty()) return;
  part.first = vertex_count();
  for (const Index v : part.vertices) {
    const Vec3f p = part.mesh.positions_m[static_cast<std::size_t>(v)],
                n = part.mesh.normals[static_cast<std::size_t>(v)];
    x_m_.push_back(obstacle.moves ? obstacle.T_world_obstacle * p : p);
    normal_.push_back(obstacle.moves ? obstacle.T_world_obstacle.R * n : n);
  }
  parts_.push_back(std::move(part));
}

void FilmObstacles::take_to_device(ExecContext& ctx) {
  std::vector<Index> corners;
  std::vector<std::vector<Index>> of(x_m_.size());
  for (const Part& part : parts_) {
    std::vector<Index> number(part.mesh.positions_m.size(), -1);
    for (std::size_t k = 0; k < part.vertices.size(); ++k)
      number[static_cast<std::size_t>(part.vertices[k])] = part.first + static_cast<Index>(k);
    for (const auto& t : part.triangles)
      for (const Index v : t) {
        const Index own = number[static_cast<std::size_t>(v)];
        of[static_cast<std::size_t>(own)].push_back(static_cast<Index>(corners.size() / 3));
        corners.push_back(own);
      }
  }
  x_ = to_device(ctx, x_m_);
  normals_ = to_device(ctx, normal_);
  corners_ = to_device(ctx, corners);
  incident_ = IndexLists(ctx, of, 0);
}

bool FilmObstacles::move() const {
  return std::any_of(parts_.begin(), parts_.end(), [](const Part& part) { return part.moving >= 0; });
}

FilmSurface FilmObstacles::surface() const {
  return {x_.size(),          corners_.size() / 3, x_.const_view(), corners_.const_view(),
          incident_.ranges(), incident_.values()};
}

void FilmObstacles::place(ExecContext& ctx, std::span<const Rigidd> T_world) {
  for (const Part& part : parts_) {
    if (part.moving < 0) continue;
    const Rigidd& T = T_world[static_cast<std::size_t>(part.moving)];
    const auto first = static_cast<std::size_t>(part.first);
    for (std::size_t k = 0; k < part.vertices.size(); ++k) {
      const auto v = static_cast<std::size_t>(part.vertices[k]);
      x_m_[first + k] = vec_cast<float>(T * vec_cast<double>(part.mesh.positions_m[v]));
      normal_[first + k] = vec_cast<float>(T.R * vec_cast<double>(part.mesh.normals[v]));
    }
    const auto count = static_cast<Index>(part.vertices.size());
    ctx.upload(std::span(x_m_).subspan(first, part.vertices.size()), x_.view().part(part.first, count));
    ctx.upload(std::span(normal_).subspan(first, part.vertices.size()),
               normals_.view().part(part.first, count));
  }
}

}  // namespace tactus
