#pragma once
/// Kernels that carry a surface along with the lattice it is embedded in.
#include <cstdint>

#include "tactus/base/vec.h"
#include "tactus/compute/kernel.h"
#include "tactus/geom/arrays/index_lists.h"
#include "tactus/geom/arrays/set_values.h"
#include "tactus/tissue/embedding.h"

namespace tactus::embed {

/// x = sum_8 phi_j(X) x_j [P 15], phi trilinear in the rest cube.
struct MoveVertices {
  View<const Anchor> anchors;
  View<const CubeNodes> cubes;
  View<const Vec3f> node_x_m;
  View<Vec3f> vertex_x_m;
  TACTUS_HD void operator()(Index v) const {
    const Anchor a = anchors[v];
    const CubeNodes c = cubes[a.cube];
    // Relative to one corner: weights that sum to 1 only to round-off then cost nothing far off the origin.
    const Vec3f base = node_x_m[c.node[0]];
    Vec3f sum{};
    for (int q = 1; q < 8; ++q) {
      const float wx = (q & 1) != 0 ? a.local.x : 1.F - a.local.x;
      const float wy = (q & 2) != 0 ? a.local.y : 1.F - a.local.y;
      const float wz = (q & 4) != 0 ? a.local.z : 1.F - a.local.z;
      sum += (wx * wy * wz) * (node_x_m[c.node[q]] - base);
    }
    vertex_x_m[v] = base + sum;
  }
};

/// Area-weighted unit normals: each vertex gathers its triangles, in ascending order.
struct GatherNormals {
  View<const IndexRange> lists;  ///< per vertex, of entries of `corners`
  View<const Index> corners;     ///< triangle ids
  View<const Index> triangles;   ///< three vertices each
  View<const Vec3f> vertex_x_m;
  View<Vec3f> normal;
  TACTUS_HD void operator()(Index v) const {
    Vec3f sum{};
    for (Index e = lists[v].begin; e < lists[v].end; ++e) {
      const Index t = 3 * corners[e];
      const Vec3f a = vertex_x_m[triangles[t]];
      sum += cross(vertex_x_m[triangles[t + 1]] - a, vertex_x_m[triangles[t + 2]] - a);
    }
    normal[v] = normalized(sum, Vec3f{0, 1, 0});
  }
};

struct SetTriangles {
  View<const TriangleChange> changes;
  View<Index> triangles;
  TACTUS_HD void operator()(Index i) const {
    for (int k = 0; k < 3; ++k) triangles[3 * changes[i].triangle + k] = changes[i].vertex[k];
  }
};

}  // namespace tactus::embed
