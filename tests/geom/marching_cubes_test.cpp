#include "tactus/geom/mesh/marching_cubes.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "tactus/geom/mesh/mesh.h"

namespace tactus {
namespace {

/// Marching cubes on a grid of signs, vertices welded by (lower node, axis).
TriangleMesh mesh_of_signs(const std::vector<bool>& inside, Index n) {
  static const std::vector<CellCase> table = make_marching_cubes_table();
  const auto node = [n](Index x, Index y, Index z) { return x + n * (y + n * z); };
  TriangleMesh mesh;
  std::map<std::pair<Index, int>, Index> vertex;
  for (Index z = 0; z + 1 < n; ++z) {
    for (Index y = 0; y + 1 < n; ++y) {
      for (Index x = 0; x + 1 < n; ++x) {
        unsigned signs = 0;
        for (int c = 0; c < 8; ++c) {
          if (inside[static_cast<std::size_t>(node(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2)))])
            signs |= 1U << c;
        }
        const CellCase& cell = table[signs];
        for (int t = 0; t < cell.triangle_count; ++t) {
          std::array<Index, 3> triangle{};
          for (int k = 0; k < 3; ++k) {
            const int e = cell.edge[3 * t + k], c = edge_corner(e);
            const Index low = node(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2));
            const auto [it, fresh] =
                vertex.try_emplace({low, e / 4}, static_cast<Index>(mesh.positions_m.size()));
            if (fresh) {
              Vec3f p{static_cast<float>(low % n), static_cast<float>(low / n % n),
                      static_cast<float>(low / n / n)};
              p[e / 4] += 0.5F;
              mesh.positions_m.push_back(p);
            }
            triangle[static_cast<std::size_t>(k)] = it->second;
          }
          mesh.triangles.push_back(triangle);
        }
      }
    }
  }
  return mesh;
}

TEST(MarchingCubes, EveryCaseUsesExactlyItsCrossedEdges) {
  const std::vector<CellCase> table = make_marching_cubes_table();
  ASSERT_EQ(table.size(), 256U);
  for (int signs = 0; signs < 256; ++signs) {
    std::set<int> crossed, used;
    for (int e = 0; e < kCellEdges; ++e) {
      const int c = edge_corner(e), d = c | 1 << (e / 4);
      if ((signs >> c & 1) != (signs >> d & 1)) crossed.insert(e);
    }
    const CellCase& cell = table[static_cast<std::size_t>(signs)];
    used.insert(cell.edge, cell.edge + 3 * cell.triangle_count);
    if (cell.triangle_count == 0) used.clear();
    EXPECT_EQ(used, crossed) << "case " << signs;
  }
}

TEST(MarchingCubes, RandomSignsGiveClosedOrientedManifolds) {
  constexpr Index n = 32;
  for (const double p : {0.3, 0.5, 0.7}) {
    std::mt19937 random(5);
    std::vector<bool> inside(n * n * n);
    for (Index i = 0; i < n * n * n; ++i) {
      const Index x = i % n, y = i / n % n, z = i / n / n;
      const bool border = x == 0 || y == 0 || z == 0 || x == n - 1 || y == n - 1 || z == n - 1;
      inside[static_cast<std::size_t>(i)] = !border && std::bernoulli_distribution(p)(random);
    }
    const MeshTopology t = topology(mesh_of_signs(inside, n));
    EXPECT_GT(t.edges, 10'000);
    EXPECT_EQ(t.boundary_edges, 0) << p;
    EXPECT_EQ(t.nonmanifold_edges, 0) << p;
    EXPECT_EQ(t.euler % 2, 0) << p;  // a closed orientable surface: 2 - 2 genus per component
  }
}

TEST(MarchingCubes, OneInsideNodeIsAnOctahedronWithOutwardNormals) {
  std::vector<bool> inside(27);
  inside[13] = true;
  const TriangleMesh mesh = mesh_of_signs(inside, 3);
  EXPECT_EQ(mesh.triangles.size(), 8U);
  EXPECT_EQ(topology(mesh).euler, 2);
  // Octahedron with half-diagonal 1/2: 4/3 * (1/2)^3.
  EXPECT_NEAR(volume_m3(mesh), 1.0 / 6, 1e-6);
}

}  // namespace
}  // namespace tactus
