#pragma once
/// Meshes for the tests of pictures and silhouettes.
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>

#include "tactus/geom/mesh/mesh.h"

namespace tactus::test {

/// Latitude-longitude sphere, closed, its corners on the sphere; `rings` x 2 `rings` facets.
inline TriangleMesh sphere(Vec3f center_m, float radius_m, Index rings) {
  TriangleMesh mesh;
  const Index columns = 2 * rings;
  const auto add = [&](double theta, double phi) {
    const Vec3d n{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)};
    mesh.normals.push_back(vec_cast<float>(n));
    mesh.positions_m.push_back(center_m + radius_m * vec_cast<float>(n));
  };
  add(0, 0);
  for (Index i = 1; i < rings; ++i) {
    for (Index j = 0; j < columns; ++j) add(std::numbers::pi * i / rings, 2 * std::numbers::pi * j / columns);
  }
  add(std::numbers::pi, 0);
  const Index last = static_cast<Index>(mesh.positions_m.size()) - 1;
  const auto at = [&](Index i, Index j) {
    return i == 0 ? 0 : i == rings ? last : 1 + (i - 1) * columns + j % columns;
  };
  for (Index i = 0; i < rings; ++i) {
    for (Index j = 0; j < columns; ++j) {
      if (i > 0) mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
      if (i + 1 < rings) mesh.triangles.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return mesh;
}

inline TriangleMesh box(Vec3f low, Vec3f high) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.positions_m.push_back({i & 1 ? high.x : low.x, i & 2 ? high.y : low.y, i & 4 ? high.z : low.z});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

}  // namespace tactus::test
