#pragma once
/// A film that goes from one mesh of a surface to the next, which has other vertices and triangles.
///
/// A vertex' volume lies round its centroid: the vertex and an offset. It lands where the centroid is on the
/// new surface, in the triangle there, by barycentric weights times the areas of the corners. A
/// corner's share lies between the corner u and the place q: its centroid is (u + q) / 2, and a little more,
/// so that the sum of all is q. So nothing drifts, whatever the lattices' places, and on lattices of one kind
/// a film's edge does not creep outwards: a hat's share of a box is one whose centroid is half way.
///
/// Volumes and moments are sums of integers: no order matters. Lists are in the order of vertices.
#include "tactus/compute/atomic.h"
#include "tactus/fluid/film/film_carry_views.h"
#include "tactus/fluid/film/film_region_kernels.h"
#include "tactus/geom/mesh/closest_point.h"
#include "tactus/geom/mesh/mesh_view.h"

namespace tactus {

/// Links the mesh now, where `wanted` says so and it isn't yet. A mesh that is too large has no film.
struct PlanFilmLink {
  MeshView mesh;
  View<const Index> wanted;  ///< (1)
  FilmCarryCounts counts;
  Index most_vertices = 0, most_triangles = 0;
  TACTUS_HD void operator()(Index) const {
    const Index n = mesh.vertex_count.get(), m = mesh.triangle_count.get();
    const bool links = wanted[0] > 0 && counts.all[FilmCarryCounts::kVertices] == 0 && n >= 0 && m >= 0 &&
                       n <= most_vertices && m <= most_triangles;
    counts.all[FilmCarryCounts::kLinkVertices] = links ? n : 0;
    counts.all[FilmCarryCounts::kLinkTriangles] = links ? m : 0;
    if (!links) return;
    counts.all[FilmCarryCounts::kVertices] = n;
    counts.all[FilmCarryCounts::kTriangles] = m;
  }
};

/// Thread: vertex of the new mesh. Nothing lies there yet.
struct BeginFilmLinks {
  MeshView mesh;
  View<Vec3f> x_m, offset_m;
  View<Index> degree;
  View<std::uint64_t> moment;  ///< four fields: along x, y and z, and the weight
  TACTUS_HD void operator()(Index v) const {
    x_m[v] = mesh.positions_m[v];
    offset_m[v] = {};
    degree[v] = 0;
    const Index n = moment.size() / 4;
    for (Index k = 0; k < 4; ++k) moment[k * n + v] = 0;
  }
};

/// Triangles of a mesh whose corners it has.
struct LinkedTriangles {
  MeshView mesh;
  TACTUS_HD bool has(Index t) const {
    const Vec3i c = mesh.triangles[t];
    const Index n = mesh.vertex_count.get();
    return min(c.x, min(c.y, c.z)) >= 0 && max(c.x, max(c.y, c.z)) < n;
  }
};

/// Thread: triangle.
struct CountFilmCorners {
  LinkedTriangles of;
  View<Index> degree;
  TACTUS_HD void operator()(Index t) const {
    if (!of.has(t)) return;
    for (int k = 0; k < 3; ++k)
      atomic_add(reinterpret_cast<std::uint32_t&>(degree[of.mesh.triangles[t][k]]), 1U);
  }
};

/// Thread: vertex. Its list is empty.
struct OpenFilmLists {
  View<const Index> first;
  View<IndexRange> lists;
  TACTUS_HD void operator()(Index v) const { lists[v] = {first[v], first[v]}; }
};

/// Thread: triangle. Lists are in no certain order yet.
struct FillFilmLists {
  LinkedTriangles of;
  View<IndexRange> lists;
  View<Index> incident;
  TACTUS_HD void operator()(Index t) const {
    if (!of.has(t)) return;
    for (int k = 0; k < 3; ++k) {
      auto& end = reinterpret_cast<std::uint32_t&>(lists[of.mesh.triangles[t][k]].end);
      incident[static_cast<Index>(atomic_fetch_add(end, 1U))] = t;
    }
  }
};

/// Thread: vertex. Sorts its list, so sums along it are the same everywhere; and the vertex' normal.
struct SortFilmLists {
  MeshView mesh;
  View<const IndexRange> lists;
  View<Index> incident;
  View<Vec3f> normal;
  TACTUS_HD void operator()(Index v) const {
    const IndexRange list = lists[v];
    for (Index e = list.begin + 1; e < list.end; ++e) {
      const Index t = incident[e];
      Index to = e;
      for (; to > list.begin && incident[to - 1] > t; --to) incident[to] = incident[to - 1];
      incident[to] = t;
    }
    Vec3f sum{};
    for (Index e = list.begin; e < list.end; ++e) {
      const Vec3i c = mesh.triangles[incident[e]];
      const Vec3f a = mesh.positions_m[c.x];
      sum += cross(mesh.positions_m[c.y] - a, mesh.positions_m[c.z] - a);
    }
    normal[v] = normalized(sum);
  }
};

/// Thread: vertex of the last surface.
struct FlagFilm {
  FilmStore film;
  View<Index> flag;
  TACTUS_HD void operator()(Index v) const {
    flag[v] = film.gains.volume[v] > 0 || film.stain[v] > 0 ? 1 : 0;
  }
};

/// Thread: vertex on which something lies. Takes it off.
struct LiftFilm {
  FilmStore film;
  View<const Index> list;
  View<const Vec3f> x_m, offset_m, normal;
  View<const Index> tag;
  View<FilmPoint> point;
  View<Vec3f> place_m;
  TACTUS_HD void operator()(Index i) const {
    const Index v = list[i];
    point[i] = {film.gains.volume[v], film.stain[v], normal[v], tag[v], film.change[v], -1};
    place_m[i] = x_m[v] + offset_m[v];
    film.gains.volume[v] = film.stain[v] = 0;
  }
};

/// Thread: place where film waits. It tries again, behind those that were lifted.
struct RetryFilm {
  FilmCarryCounts counts;
  View<const FilmPoint> waiting;
  View<const Vec3f> waiting_m;
  View<FilmPoint> point;
  View<Vec3f> place_m;
  Index first = 0;
  TACTUS_HD void load() { first = counts.all[FilmCarryCounts::kHeld]; }
  TACTUS_HD void operator()(Index k) const {
    point[first + k] = waiting[k];
    place_m[first + k] = waiting_m[k];
  }
};

/// Thread: vertex of the film's list. It is dry, and of no surface any more.
struct ForgetFilm {
  FilmStore film;
  TACTUS_HD void operator()(Index i) const {
    const Index v = film.gains.near[i];
    film.gains.mark[v] = 0;
    film.height_m[v] = 0;
    film.change[v] = 0;
  }
};

/// All is lifted.
struct EndLifting {
  FilmCarryCounts counts;
  FilmStore film;
  View<FilmWaiting> waiting;
  TACTUS_HD void operator()(Index) const {
    counts.all[FilmCarryCounts::kPoints] =
        counts.all[FilmCarryCounts::kHeld] + counts.all[FilmCarryCounts::kWaiting];
    counts.all[FilmCarryCounts::kVertices] = counts.all[FilmCarryCounts::kTriangles] = 0;
    film.gains.counts.all[FilmCounts::kNear] = 0;
    waiting[0] = {};
  }
};

/// For each point: the nearest vertex that faces as it does.
struct FindLanding {
  static constexpr bool kNearOnly = true;
  template <int kLanes>
  struct Own {
    Vec3f p[kLanes], n[kLanes];
    float least2[kLanes];
    Index vertex[kLanes];
  };
  View<const Index> point_order, vertex_order;  ///< numbers of the searches' slots
  View<const Vec3f> place_m, x_m, normal;
  View<FilmPoint> point;
  template <int kLanes>
  TACTUS_HD void begin(Own<kLanes>& own, int t, Index i) const {
    own.p[t] = place_m[point_order[i]];
    own.n[t] = point[point_order[i]].normal;
    own.least2[t] = 1e30F;
    own.vertex[t] = -1;
  }
  template <int kLanes>
  TACTUS_HD void add(Own<kLanes>& own, int t, Index j, Vec3f, float, bool) const {
    const Index v = vertex_order[j];
    if (!(dot(normal[v], own.n[t]) > 0)) return;
    const Vec3f d = own.p[t] - x_m[v];
    const float r2 = dot(d, d);
    if (r2 < own.least2[t] || (r2 == own.least2[t] && v < own.vertex[t])) {
      own.least2[t] = r2;
      own.vertex[t] = v;
    }
  }
  template <int kLanes>
  TACTUS_HD void end(const Own<kLanes>& own, int t, Index i) const {
    point[point_order[i]].vertex = own.vertex[t];
  }
};

/// Moments are multiples of 2^-24 m times 2^8 units.
inline constexpr float kFilmMoments_1_m = 16777216.F;
inline constexpr unsigned kFilmMomentShift = 8;

/// Thread: point. Lays it down round its vertex; flags it where it has none.
struct LandFilm {
  FilmSurface surface;
  FilmStore film;
  View<const Vec3f> place_m;
  View<FilmPoint> point;
  View<std::uint64_t> moment;
  View<Index> flag;
  TACTUS_HD void operator()(Index i) const {
    const FilmPoint p = point[i];
    Landing at;
    if (p.vertex >= 0) at = find(p.vertex, place_m[i]);
    flag[i] = at.triangle < 0 ? 1 : 0;
    if (at.triangle < 0) return;
    std::int64_t units = p.units, stain = p.stain;
    int most = 0;  // it gets the rest that rounding leaves
    for (int k = 1; k < 3; ++k) most = at.share[k] > at.share[most] ? k : most;
    for (int n = 1; n <= 3; ++n) {
      const int k = (most + n) % 3;
      const std::int64_t u = n < 3 ? part_of(p.units, at.share[k], units) : units;
      const std::int64_t s = n < 3 ? part_of(p.stain, at.share[k], stain) : stain;
      units -= u;
      stain -= s;
      if (u > 0 || s > 0)
        give(at.corner[k], u, s, at.offset_m[k], at.share[k] * static_cast<float>(p.change));
    }
  }

 private:
  /// A corner gets so much of a point's volume, or none: else a film would wet all that it comes near to.
  static constexpr float kLeastShare = 0.0625F;
  struct Landing {
    Index triangle = -1;
    Index corner[3];
    float share[3];
    Vec3f offset_m[3];
  };
  TACTUS_HD static std::int64_t part_of(std::int64_t all, float share, std::int64_t left) {
    return min(left, static_cast<std::int64_t>(share * static_cast<float>(all)));
  }
  TACTUS_HD float fan_m2(Index v) const {
    float area = 0;
    for (Index e = surface.lists[v].begin; e < surface.lists[v].end; ++e) {
      const Index t = surface.incident[e];
      const Vec3f a = surface.x_m[surface.corners[3 * t]];
      area += length(
          cross(surface.x_m[surface.corners[3 * t + 1]] - a, surface.x_m[surface.corners[3 * t + 2]] - a));
    }
    return area;
  }
  /// The nearest triangle round a vertex, and the share of each of its corners.
  TACTUS_HD Landing find(Index v, Vec3f p_m) const {
    Landing at;
    float least2 = 1e30F;
    Vec3f q{};
    for (Index e = surface.lists[v].begin; e < surface.lists[v].end; ++e) {
      const Index t = surface.incident[e];
      // In coordinates round p: those of the world would round it.
      const Vec3f a = surface.x_m[surface.corners[3 * t]] - p_m,
                  b = surface.x_m[surface.corners[3 * t + 1]] - p_m,
                  c = surface.x_m[surface.corners[3 * t + 2]] - p_m, across = cross(b - a, c - a);
      if (!(dot(across, across) > 1e-24F)) continue;
      const Vec3f nearest = closest_point_on_triangle(Vec3f{}, a, b, c);
      const float r2 = dot(nearest, nearest);
      if (!(r2 < least2)) continue;
      least2 = r2;
      q = nearest;
      at.triangle = t;
    }
    if (at.triangle >= 0) divide(at, q, p_m);
    return at;
  }
  TACTUS_HD void divide(Landing& at, Vec3f q, Vec3f p_m) const {
    Vec3f x[3];
    float sum = 0;
    for (int k = 0; k < 3; ++k) {
      at.corner[k] = surface.corners[3 * at.triangle + k];
      x[k] = surface.x_m[at.corner[k]] - p_m;
    }
    const Vec3f n = cross(x[1] - x[0], x[2] - x[0]);
    for (int k = 0; k < 3; ++k) {
      const float weight = max(dot(cross(x[(k + 1) % 3] - q, x[(k + 2) % 3] - q), n), 0.F);
      at.share[k] = weight * fan_m2(at.corner[k]);
      sum += at.share[k];
    }
    float kept = 0;
    for (float& share : at.share) {
      share = sum > 0 ? share / sum : 1.F / 3;
      if (share < kLeastShare) share = 0;
      kept += share;
    }
    Vec3f mean{};
    for (int k = 0; k < 3; ++k) {
      at.share[k] /= kept;
      mean += at.share[k] * x[k];
    }
    for (int k = 0; k < 3; ++k) at.offset_m[k] = 0.5F * ((q - x[k]) + (q - mean));
  }
  TACTUS_HD void give(Index v, std::int64_t units, std::int64_t stain, Vec3f offset_m, float change) const {
    film.gains.give(v, units);
    atomic_add(reinterpret_cast<std::uint64_t&>(film.stain[v]), static_cast<std::uint64_t>(stain));
    constexpr float kMostChange = 1 << 26;  // of 32 that land on one vertex
    atomic_add(reinterpret_cast<std::uint32_t&>(film.change[v]),
               static_cast<std::uint32_t>(min(abs(change), kMostChange)));
    const std::int64_t weight = (units + stain) >> kFilmMomentShift;
    const Index n = moment.size() / 4;
    for (int k = 0; k < 3; ++k) {
      const auto along = static_cast<std::int64_t>(kFilmMoments_1_m * clamp(offset_m[k], -0.1F, 0.1F));
      atomic_add(moment[k * n + v], static_cast<std::uint64_t>(weight * along));
    }
    atomic_add(moment[3 * n + v], static_cast<std::uint64_t>(weight));
  }
};

/// Thread: vertex of the film's list. Where its volume's centroid is.
struct SettleFilm {
  View<const Index> list;
  View<const std::uint64_t> moment;
  View<Vec3f> offset_m;
  TACTUS_HD void operator()(Index i) const {
    const Index v = list[i], n = moment.size() / 4;
    const auto weight = static_cast<float>(moment[3 * n + v]);
    Vec3f sum{};
    for (int k = 0; k < 3; ++k) sum[k] = static_cast<float>(static_cast<std::int64_t>(moment[k * n + v]));
    offset_m[v] = weight > 0 ? (1.F / (kFilmMoments_1_m * weight)) * sum : Vec3f{};
  }
};

/// Thread: point that found no surface. It waits where it is.
struct KeepWaitingFilm {
  View<const Index> list;
  View<const FilmPoint> point;
  View<const Vec3f> place_m;
  View<FilmPoint> waiting;
  View<Vec3f> waiting_m;
  View<FilmWaiting> sums;
  TACTUS_HD void operator()(Index k) const {
    FilmPoint p = point[list[k]];
    atomic_add(sums[0].film, static_cast<std::uint64_t>(p.units));
    atomic_add(sums[0].stain, static_cast<std::uint64_t>(p.stain));
    if (k >= waiting.size()) return;
    p.tag = -1;
    p.change = 0;
    waiting[k] = p;
    waiting_m[k] = place_m[list[k]];
  }
};

/// Where too many wait, the last place has all the others, too.
struct EndWaitingFilm {
  FilmCarryCounts counts;
  View<const Index> list;
  View<const FilmPoint> point;
  View<FilmPoint> waiting;
  TACTUS_HD void operator()(Index) const {
    const Index n = counts.all[FilmCarryCounts::kWaiting], most = waiting.size();
    for (Index k = most; k < n; ++k) {
      waiting[most - 1].units += point[list[k]].units;
      waiting[most - 1].stain += point[list[k]].stain;
    }
    counts.all[FilmCarryCounts::kWaiting] = min(n, most);
    counts.all[FilmCarryCounts::kPoints] = 0;
  }
};

}  // namespace tactus
