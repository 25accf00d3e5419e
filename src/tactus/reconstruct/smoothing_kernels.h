#pragma once
/// Smoothing of a mesh that keeps edges and volume: normals of faces are filtered by their likeness, then
/// vertices follow them (Sun et al. 2007, "Fast and effective feature-preserving mesh denoising"; weights by
/// likeness after Zheng et al. 2011, "Bilateral normal filtering for mesh denoising"). All passes gather over
/// sorted fans, so the order of sums is fixed.
#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"

namespace tactus {

/// Corners (3 i + j is corner j of triangle i) with the vertex they belong to; unused ones come last.
struct ListCorners {
  View<const Vec3i> triangles;
  Count triangle_count;
  View<std::uint32_t> vertices;
  View<Index> corners;
  TACTUS_HD void operator()(Index i) const {
    const bool used = i / 3 < triangle_count.get();
    vertices[i] = used ? static_cast<std::uint32_t>(triangles[i / 3][i % 3]) : 0x7fffffffU;
    corners[i] = i;
  }
};

/// Where the corners of each vertex begin, by bisection of the sorted list.
struct FindFans {
  static constexpr int kGrain = 512;
  View<const std::uint32_t> vertices;
  View<Index> begin;  ///< one more than there are vertices
  TACTUS_HD void operator()(Index v) const {
    Index low = 0, high = vertices.size();
    while (low < high) {
      const Index middle = low + (high - low) / 2;
      const bool before = vertices[middle] < static_cast<std::uint32_t>(v);
      low = before ? middle + 1 : low;
      high = before ? high : middle;
    }
    begin[v] = low;
  }
};

/// Sorted corners of all vertices.
struct Fans {
  View<const Index> begin, corners;
  /// f(triangle) for the triangles around v, ascending.
  template <class F>
  TACTUS_HD void for_each(Index v, F&& f) const {
    for (Index i = begin[v]; i < begin[v + 1]; ++i) f(corners[i] / 3);
  }
};

/// Unit normal and area of every triangle, and its contribution to the volume.
struct MeasureFaces {
  static constexpr int kGrain = 512;
  View<const Vec3f> positions_m;
  View<const Vec3i> triangles;
  Count triangle_count;
  View<Vec3f> normals;
  View<float> areas_m2, volumes_m3;  ///< 0 for triangles that are not there
  TACTUS_HD void operator()(Index i) const {
    if (i >= triangle_count.get()) {
      areas_m2[i] = volumes_m3[i] = 0;
      return;
    }
    const Vec3i t = triangles[i];
    const Vec3f a = positions_m[t.x], b = positions_m[t.y], c = positions_m[t.z];
    const Vec3f doubled = cross(b - a, c - a), origin = positions_m[triangles[0].x];
    const float length = tactus::sqrt(dot(doubled, doubled));
    normals[i] = length > 0 ? (1.F / length) * doubled : Vec3f{};
    areas_m2[i] = 0.5F * length;
    volumes_m3[i] = (1.F / 6.F) * dot(a - origin, cross(b - origin, c - origin));
  }
};

/// Mean of the normals around a triangle, over all that share a corner with it. Weights: area, and
/// ((cos - kLeast) / (1 - kLeast))^2 of the angle between the two: beyond 60 degrees an edge is an edge.
struct FilterNormals {
  static constexpr int kGrain = 128;
  static constexpr float kLeast = 0.5F;
  View<const Vec3i> triangles;
  Fans fans;
  View<const float> areas_m2;
  View<const Vec3f> normals;
  View<Vec3f> filtered;
  TACTUS_HD void operator()(Index i) const {
    const Vec3f own = normals[i];
    Vec3f sum = areas_m2[i] * own;
    for (int corner = 0; corner < 3; ++corner) {
      fans.for_each(triangles[i][corner], [&](Index j) {
        const float like = max(dot(own, normals[j]) - kLeast, 0.F) * (1.F / (1.F - kLeast));
        sum += areas_m2[j] * like * like * normals[j];
      });
    }
    filtered[i] = normalized(sum, own);
  }
};

/// Each vertex moves to the mean of its projections on the planes around it, through the triangles'
/// centroids.
struct FollowNormals {
  static constexpr int kGrain = 128;
  View<const Vec3f> positions_m;
  View<const Vec3i> triangles;
  Fans fans;
  View<const float> areas_m2;
  View<const Vec3f> normals;
  View<Vec3f> moved_m;
  TACTUS_HD void operator()(Index v) const {
    const Vec3f p = positions_m[v];
    Vec3f sum{};
    float weight = 0;
    fans.for_each(v, [&](Index j) {
      const Vec3i t = triangles[j];
      const Vec3f to_centroid =
          (1.F / 3.F) * ((positions_m[t.x] - p) + (positions_m[t.y] - p) + (positions_m[t.z] - p));
      sum += areas_m2[j] * dot(normals[j], to_centroid) * normals[j];
      weight += areas_m2[j];
    });
    moved_m[v] = weight > 0 ? p + (1.F / weight) * sum : p;
  }
};

/// Outward direction of every vertex, and by how much the volume grows when it moves along by 1 m.
struct FindGrowth {
  static constexpr int kGrain = 256;
  Count vertex_count;
  Fans fans;
  View<const float> areas_m2;
  View<const Vec3f> normals;  ///< of the triangles, as they are
  View<Vec3f> directions;
  View<float> growth_m2;  ///< 0 for vertices that are not there
  TACTUS_HD void operator()(Index v) const {
    growth_m2[v] = 0;
    if (v >= vertex_count.get()) return;
    Vec3f sum{};
    fans.for_each(v, [&](Index j) { sum += areas_m2[j] * normals[j]; });
    const float length = tactus::sqrt(dot(sum, sum));
    directions[v] = length > 0 ? (1.F / length) * sum : Vec3f{};
    growth_m2[v] = (1.F / 3.F) * length;
  }
};

/// Moves all vertices along their directions by the one distance that gives the wanted volume (to first
/// order).
struct RestoreVolume {
  View<const float> wanted_m3, volume_m3, growth_m2;  ///< one each
  View<const Vec3f> directions;
  float most_m;  ///< farther is no correction: an open mesh has no volume
  View<Vec3f> positions_m;
  TACTUS_HD void operator()(Index v) const {
    const float growth = growth_m2[0];
    const float distance = growth > 0 ? (wanted_m3[0] - volume_m3[0]) / growth : 0.F;
    positions_m[v] += clamp(distance, -most_m, most_m) * directions[v];
  }
};

}  // namespace tactus
