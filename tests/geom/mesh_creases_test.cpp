/// Normals at creases.
#include <gtest/gtest.h>

#include "tactus/geom/mesh/box_surface.h"
#include "tactus/geom/mesh/mesh_creases.h"

namespace tactus {
namespace {

/// Eight vertices, each at three faces: 24 normals, along the axes to the rounding of a division.
TEST(SplitCreases, ACubeHasSixFaces) {
  TriangleMesh cube;
  for (int q = 0; q < 8; ++q)
    cube.positions_m.push_back(
        {static_cast<float>(q & 1), static_cast<float>(q >> 1 & 1), static_cast<float>(q >> 2)});
  cube.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const TriangleMesh before = cube;
  const std::vector<Index> origins = split_creases(cube);
  ASSERT_EQ(cube.positions_m.size(), 24U);
  ASSERT_EQ(origins.size(), 16U);
  for (std::size_t k = 0; k < origins.size(); ++k)
    EXPECT_EQ(cube.positions_m[8 + k], before.positions_m[static_cast<std::size_t>(origins[k])]);
  ASSERT_EQ(cube.normals.size(), 24U);
  ASSERT_EQ(cube.triangles.size(), before.triangles.size());
  for (std::size_t t = 0; t < cube.triangles.size(); ++t) {
    const auto p = [&](std::size_t k) {
      return cube.positions_m[static_cast<std::size_t>(cube.triangles[t].at(k))];
    };
    const Vec3f own = normalized(cross(p(1) - p(0), p(2) - p(0)));
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(p(k), before.positions_m[static_cast<std::size_t>(before.triangles[t].at(k))]);
      EXPECT_GT(dot(own, cube.normals[static_cast<std::size_t>(cube.triangles[t].at(k))]), 1 - 1e-6F);
    }
  }
}

/// Four of its vertices, which are of a smooth surface, stay whole: the other four become three each.
TEST(SplitCreases, FirstVerticesStayWhole) {
  TriangleMesh cube = box_surface({1, 1, 1}, Vec3i{1, 1, 1});
  ASSERT_EQ(cube.positions_m.size(), 8U);
  EXPECT_EQ(split_creases(cube, 4), (std::vector<Index>{4, 4, 5, 5, 6, 6, 7, 7}));
}

/// A roof of 20 degrees is no crease, and its normals stay; nor is a needle on it, whichever way it faces.
TEST(SplitCreases, AFlatRoofStaysAsItIs) {
  TriangleMesh roof;
  roof.positions_m = {{0, 0.18F, 0}, {0, 0.18F, 1}, {-1, 0, 0}, {1, 0, 0}, {0, 0.1801F, 0.5F}};
  roof.triangles = {{0, 1, 3}, {1, 0, 2}, {0, 4, 1}};
  roof.normals.assign(5, {0, 1, 0});
  const TriangleMesh before = roof;
  split_creases(roof);
  EXPECT_EQ(roof.positions_m.size(), before.positions_m.size());
  EXPECT_EQ(roof.normals, before.normals);
  EXPECT_EQ(roof.triangles, before.triangles);
}

/// A plane whose normals waver by +-0.1 from row to row, as a lattice's cubes leave them, and a wall at its
/// end. A vertex within is averaged with two neighbours in its row, of weight 1, and four in the rows beside,
/// of weight 0.89: each pass leaves |1 + 2 - 3.6| / 6.6 of what wavers, four leave 1e-4; the rims, 6 rows
/// off, have no say. The wall keeps its normal.
TEST(SmoothNormals, WaveringGoesAndEdgesStay) {
  TriangleMesh mesh;
  constexpr Index kSide = 24;
  const auto vertex = [](Index i, Index j) { return i * kSide + j; };
  for (Index i = 0; i < kSide; ++i) {
    for (Index j = 0; j < kSide; ++j) {
      mesh.positions_m.push_back({static_cast<float>(j), 0, static_cast<float>(i)});
      mesh.normals.push_back(normalized(Vec3f{0, 1, i % 2 == 0 ? 0.1F : -0.1F}));
    }
  }
  for (Index i = 0; i + 1 < kSide; ++i) {
    for (Index j = 0; j + 1 < kSide; ++j) {
      mesh.triangles.push_back({vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)});
      mesh.triangles.push_back({vertex(i, j + 1), vertex(i + 1, j), vertex(i + 1, j + 1)});
    }
  }
  const auto wall = static_cast<Index>(mesh.positions_m.size());
  mesh.positions_m.push_back({-1, -1, 0});
  mesh.normals.push_back({-1, 0, 0});
  mesh.triangles.push_back({vertex(0, 0), wall, vertex(1, 0)});
  smooth_normals(mesh, 4);
  for (Index i = 6; i < kSide - 6; ++i)
    EXPECT_NEAR(mesh.normals[static_cast<std::size_t>(vertex(i, kSide / 2))].z, 0, 1e-3F);
  EXPECT_EQ(mesh.normals.back(), (Vec3f{-1, 0, 0}));
}

}  // namespace
}  // namespace tactus
