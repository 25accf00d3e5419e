#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tactus/base/error.h"
#include "tactus/geom/maths/symmetric_eigen.h"
#include "tactus/reconstruct/components.h"

namespace tactus {
namespace {

/// A box of 2 triangles a side.
TriangleMesh box(Vec3f center, Vec3f half) {
  TriangleMesh m;
  for (int i = 0; i < 8; ++i) {
    m.positions_m.push_back(center + Vec3f{(i & 1) != 0 ? half.x : -half.x, (i & 2) != 0 ? half.y : -half.y,
                                           (i & 4) != 0 ? half.z : -half.z});
  }
  m.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                 {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return m;
}
void append(TriangleMesh& to, const TriangleMesh& from) {
  const auto base = static_cast<Index>(to.positions_m.size());
  to.positions_m.insert(to.positions_m.end(), from.positions_m.begin(), from.positions_m.end());
  for (const auto& t : from.triangles) to.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}
TriangleMesh moved(TriangleMesh mesh, const Rigidf& T) {
  for (Vec3f& p : mesh.positions_m) p = T * p;
  return mesh;
}

TEST(Components, OfBoxesHaveTheirMoments) {
  const Mat3f turn = rotation_matrix(axis_angle(normalized(Vec3f{1, 2, 2}), 0.7F));
  TriangleMesh mesh = moved(box({}, {0.05F, 0.1F, 0.2F}), {turn, {1, 2, 3}});
  append(mesh, box({-1, 0, 0}, {0.3F, 0.3F, 0.3F}));
  mesh.positions_m.push_back({9, 9, 9});  // in no triangle
  const MeshComponents c = find_components(mesh);
  ASSERT_EQ(c.components.size(), 2U);
  EXPECT_EQ(c.of_vertex.back(), -1);
  EXPECT_EQ(c.of_vertex.front(), 1);
  // Float32 positions: 1e-7 of 3 m over 5 cm, so 1e-5 is safe for ratios, squares of it for lengths.
  EXPECT_NEAR(c.components[0].volume_m3, 0.216, 1e-6);
  const MeshComponent& p = c.components[1];
  EXPECT_EQ(p.vertices, 8);
  EXPECT_EQ(p.triangles, 12);
  EXPECT_NEAR(p.volume_m3, 0.1 * 0.2 * 0.4, 1e-7);
  EXPECT_NEAR(p.area_m2, 2 * (0.1 * 0.2 + 0.2 * 0.4 + 0.4 * 0.1), 1e-6);
  EXPECT_LT(length(p.centroid_m - Vec3d{1, 2, 3}), 1e-6);
  for (int i = 0; i < 3; ++i) {
    const double side = i == 0 ? 0.4 : (i == 1 ? 0.2 : 0.1);
    EXPECT_NEAR(p.extent_m[i], side / std::sqrt(12.0), 1e-5);  // standard deviation of a uniform segment
    EXPECT_NEAR(std::abs(dot(p.axes.row[i], vec_cast<double>(turn.column(2 - i)))), 1, 1e-5);
  }
  EXPECT_NEAR(determinant(p.axes), 1, 1e-9);
}

TEST(Components, AnEmptyMeshHasNoneAndABadOneIsRefused) {
  EXPECT_TRUE(find_components({}).components.empty());
  TriangleMesh bad = box({}, {1, 1, 1});
  bad.triangles.push_back({0, 1, 8});
  EXPECT_THROW(find_components(bad), Error);
}

/// A brick that turns twice about the vertical: its axes turn with it, without a flip.
TEST(Components, AxesKeepTheirSigns) {
  Mat3d before = Mat3d::zero();
  for (int frame = 0; frame <= 72; ++frame) {
    const double angle = 4 * std::numbers::pi / 72 * frame;
    const Mat3f turn = rotation_matrix(axis_angle(Vec3f{0, 1, 0}, static_cast<float>(angle)));
    const MeshComponents c = find_components(moved(box({}, {0.2F, 0.05F, 0.1F}), {turn, {0.3F, 0.4F, 0}}));
    const Mat3d axes = frame > 0 ? with_signs_of(before, c.components[0].axes) : c.components[0].axes;
    EXPECT_NEAR(determinant(axes), 1, 1e-9);
    for (int i = 0; i < 3 && frame > 0; ++i)  // 10 degrees a frame; float32 positions: 1e-5
      EXPECT_GT(dot(axes.row[i], before.row[i]), std::cos(10 * std::numbers::pi / 180) - 1e-4) << frame;
    before = axes;
  }
}

TEST(SymmetricEigenTest, SolvesRandomMatrices) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 50; ++k) {
    Mat3d a = Mat3d::zero();
    for (int i = 0; i < 3; ++i) {
      for (int j = i; j < 3; ++j) a(i, j) = a(j, i) = normal(random);
    }
    const SymmetricEigen e = symmetric_eigen(a);
    EXPECT_GE(e.values.x, e.values.y);
    EXPECT_GE(e.values.y, e.values.z);
    // Jacobi is good to some rounding errors of the norm.
    for (int i = 0; i < 3; ++i)
      EXPECT_LT(length(a * e.vectors.row[i] - e.values[i] * e.vectors.row[i]), 1e-12);
    EXPECT_NEAR(determinant(e.vectors), 1, 1e-12);
  }
}

}  // namespace
}  // namespace tactus
