#include "tactus/geom/mesh/polygonize.h"

#include <tbb/parallel_for.h>

#include <string>
#include <unordered_map>

#include "tactus/base/error.h"
#include "tactus/geom/mesh/marching_cubes.h"

namespace tactus {
namespace {

struct Grid {
  Vec3i nodes;
  Vec3f origin_m;
  float spacing_m;
  std::vector<float> value;

  std::size_t index(Vec3i n) const {
    return static_cast<std::size_t>(n.x) +
           static_cast<std::size_t>(nodes.x) *
               (static_cast<std::size_t>(n.y) +
                static_cast<std::size_t>(nodes.y) * static_cast<std::size_t>(n.z));
  }
  Vec3f at(Vec3i n) const { return origin_m + spacing_m * vec_cast<float>(n); }
};

Vec3i corner_offset(int corner) { return {corner & 1, corner >> 1 & 1, corner >> 2}; }

}  // namespace

TriangleMesh polygonize(const Box3f& box_m, Index cells, const std::function<float(Vec3f)>& distance_m,
                        float steepest) {
  const Vec3f extent = box_m.extent();
  if (!(extent.x > 0 && extent.y > 0 && extent.z > 0)) throw Error("polygonize: the box is empty");
  if (cells < 1 || cells > 1000)
    throw Error("polygonize: cells is " + std::to_string(cells) + ", expected 1 to 1000");
  Grid grid;
  grid.spacing_m = max(extent.x, max(extent.y, extent.z)) / static_cast<float>(cells);
  const auto nodes_along = [&](float side_m) {
    return static_cast<Index>(side_m / grid.spacing_m + 0.999F) + 3;
  };
  grid.nodes = {nodes_along(extent.x), nodes_along(extent.y), nodes_along(extent.z)};
  grid.origin_m = box_m.min - Vec3f{grid.spacing_m, grid.spacing_m, grid.spacing_m};
  grid.value.resize(grid.index({0, 0, grid.nodes.z}));
  const Vec3i n = grid.nodes;
  tbb::parallel_for(Index{0}, n.z, [&](Index z) {
    for (Index y = 0; y < n.y; ++y) {
      // Nodes up to here are farther outside than an edge of a cell is long: no vertex is on their edges.
      Index outside = -1;
      for (Index x = 0; x < n.x; ++x) {
        float& value = grid.value[grid.index({x, y, z})];
        value = 1;
        if (x <= outside) continue;
        const bool rim = x == 0 || y == 0 || z == 0 || x + 1 == n.x || y + 1 == n.y || z + 1 == n.z;
        const float d = distance_m(grid.at({x, y, z}));
        value = rim ? max(d, 1e-6F) : d;
        const float edges = d / (steepest * grid.spacing_m) - 1.01F;
        if (edges > 0) outside = x + static_cast<Index>(min(edges, static_cast<float>(n.x)));
      }
    }
  });
  const std::vector<CellCase> cases = make_marching_cubes_table();
  TriangleMesh mesh;
  std::unordered_map<std::size_t, Index> vertex_of_edge;
  const auto vertex = [&](Vec3i cell, int edge) {
    const int axis = edge >> 2, low = edge_corner(edge);
    const Vec3i a = cell + corner_offset(low), b = cell + corner_offset(low | 1 << axis);
    const auto [found, added] = vertex_of_edge.try_emplace(3 * grid.index(a) + static_cast<std::size_t>(axis),
                                                           static_cast<Index>(mesh.positions_m.size()));
    if (added) {
      const float va = grid.value[grid.index(a)], vb = grid.value[grid.index(b)];
      const float t = clamp(va / (va - vb), 1e-3F, 1 - 1e-3F);
      mesh.positions_m.push_back(grid.at(a) + t * (grid.at(b) - grid.at(a)));
    }
    return found->second;
  };
  for (Index z = 0; z + 1 < n.z; ++z) {
    for (Index y = 0; y + 1 < n.y; ++y) {
      const float* rows[4];
      for (int r = 0; r < 4; ++r) rows[r] = &grid.value[grid.index({0, y + (r & 1), z + (r >> 1)})];
      unsigned signs = 0;  // bit c: corner c is inside; corners with x + 1 are those of the next cell's x
      for (int r = 0; r < 4; ++r) signs |= rows[r][0] < 0 ? 2U << 2 * r : 0U;
      for (Index x = 0; x + 1 < n.x; ++x) {
        signs = signs >> 1 & 0x55U;
        for (int r = 0; r < 4; ++r) signs |= rows[r][x + 1] < 0 ? 2U << 2 * r : 0U;
        const CellCase& cell = cases[signs];
        for (int k = 0; k < cell.triangle_count; ++k)
          mesh.triangles.push_back({vertex({x, y, z}, cell.edge[3 * k]),
                                    vertex({x, y, z}, cell.edge[3 * k + 1]),
                                    vertex({x, y, z}, cell.edge[3 * k + 2])});
      }
    }
  }
  return mesh;
}

}  // namespace tactus
