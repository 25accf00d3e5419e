#include "tactus/geom/mesh/box_surface.h"

#include <array>
#include <map>

namespace tactus {

TriangleMesh box_surface(Vec3f half_m, Vec3i n) {
  TriangleMesh mesh;
  std::map<std::array<Index, 3>, Index> ids;  // corners and edges belong to several faces
  const auto vertex = [&](Vec3i p) {
    const auto [place, is_new] = ids.try_emplace({p.x, p.y, p.z}, static_cast<Index>(ids.size()));
    const auto at = [](Index i, Index count, float half) {
      return half * static_cast<float>(2 * i - count) / static_cast<float>(count);
    };
    if (is_new)
      mesh.positions_m.push_back({at(p.x, n.x, half_m.x), at(p.y, n.y, half_m.y), at(p.z, n.z, half_m.z)});
    return place->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const Index side : {0, n[axis]}) {
      for (Index j = 0; j < n[v]; ++j) {
        for (Index i = 0; i < n[u]; ++i) {
          const auto corner = [&](Index a, Index b) {
            Vec3i p{};
            p[axis] = side, p[u] = i + a, p[v] = j + b;
            return vertex(p);
          };
          const Index a = corner(0, 0), c = corner(1, 1);
          const Index b = side > 0 ? corner(1, 0) : corner(0, 1), d = side > 0 ? corner(0, 1) : corner(1, 0);
          mesh.triangles.push_back({a, b, c});
          mesh.triangles.push_back({a, c, d});
        }
      }
    }
  }
  return mesh;
}

}  // namespace tactus
