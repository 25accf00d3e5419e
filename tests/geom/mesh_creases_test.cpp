/// Normals at creases.
#include <gtest/gtest.h>

#include "tactus/geom/mesh_creases.h"

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
  split_creases(cube);
  EXPECT_EQ(cube.positions_m.size(), 24U);
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

}  // namespace
}  // namespace tactus
