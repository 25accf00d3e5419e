#include "tactus/geom/mesh/bisect_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tactus/geom/mesh/box_surface.h"

namespace tactus {
namespace {

float longest_m(const TriangleMesh& mesh, const std::array<Index, 3>& t) {
  float most = 0;
  for (std::size_t k = 0; k < 3; ++k)
    most = std::max(most, length(mesh.positions_m[static_cast<std::size_t>(t.at(k))] -
                                 mesh.positions_m[static_cast<std::size_t>(t.at((k + 1) % 3))]));
  return most;
}

double least_angle(const TriangleMesh& mesh) {
  double least = M_PI;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto x = [&](std::size_t i) {
        return vec_cast<double>(mesh.positions_m[static_cast<std::size_t>(t.at((k + i) % 3))]);
      };
      const Vec3d u = x(1) - x(0), v = x(2) - x(0);
      least = std::min(least, std::atan2(length(cross(u, v)), dot(u, v)));
    }
  return least;
}

/// A closed surface stays closed, without a hanging vertex; its area and volume stay: middles of edges round
/// by 6e-8 each.
TEST(BisectEdges, KeepsASurfaceClosedAndGradesIt) {
  const TriangleMesh box = box_surface({0.1F, 0.03F, 0.07F}, {3, 1, 2});
  const std::optional<TriangleMesh> fine = bisect_edges(
      box, 0.01F, [](const Box3f& b) { return b.min.x > -0.101F && b.max.x < -0.05F; }, 20000);
  ASSERT_TRUE(fine);
  EXPECT_TRUE(topology(*fine).closed_manifold());
  EXPECT_NEAR(area_m2(*fine) / area_m2(box), 1, 1e-5);
  EXPECT_NEAR(volume_m3(*fine) / volume_m3(box), 1, 1e-5);
  EXPECT_GT(least_angle(*fine), 0.499 * least_angle(box)) << "Rosenberg and Stenger 1975";
  int coarse = 0;
  for (const auto& t : fine->triangles) {
    float high_m = -1;
    for (const Index v : t) high_m = std::max(high_m, fine->positions_m[static_cast<std::size_t>(v)].x);
    if (high_m < -0.05F) {
      EXPECT_LE(longest_m(*fine, t), 0.01F);
    }
    if (longest_m(*fine, t) > 0.03F) ++coarse;
  }
  EXPECT_GT(coarse, 0) << "far away, triangles stay as they were";
}

TEST(BisectEdges, SaysThatItWouldTakeTooManyVertices) {
  const auto everywhere = [](const Box3f&) { return true; };
  const TriangleMesh box = box_surface({0.1F, 0.1F, 0.1F}, {1, 1, 1});
  EXPECT_FALSE(bisect_edges(box, 0.001F, everywhere, 1000));
  const std::optional<TriangleMesh> same = bisect_edges(box, 1, everywhere, 0);
  ASSERT_TRUE(same);
  EXPECT_EQ(same->triangles, box.triangles);
}

}  // namespace
}  // namespace tactus
