// The mesh of a liquid: closed, and where its particles say.
#include "tactus/fluid/liquid_mesh.h"

#include <gtest/gtest.h>

#include <cmath>

namespace tactus {
namespace {

constexpr float kSpacing = 0.004F;

std::vector<Vec3f> block(Vec3i count) {
  std::vector<Vec3f> x_m;
  for (Index k = 0; k < count.x * count.y * count.z; ++k)
    x_m.push_back(kSpacing * Vec3f{static_cast<float>(k % count.x) + 0.5F,
                                   static_cast<float>(k / count.x % count.y) + 0.5F,
                                   static_cast<float>(k / count.x / count.y) + 0.5F});
  return x_m;
}

TEST(LiquidMesh, APoolIsClosedAndHasItsLevelAndVolume) {
  std::vector<Vec3f> x_m = block({30, 10, 30});
  x_m.push_back({NAN, 0, 0});  // one that left
  const TriangleMesh mesh = liquid_mesh(x_m, kSpacing);
  EXPECT_TRUE(topology(mesh).closed_manifold());
  // Edges are round, with a radius of about half a spacing: 2 % of this volume.
  EXPECT_NEAR(volume_m3(mesh) / (9000 * std::pow(static_cast<double>(kSpacing), 3)), 1, 0.03);
  double level_m = 0;
  int count = 0;
  for (const Vec3f p : mesh.positions_m) {
    if (p.y < 9 * kSpacing || std::abs(p.x - 15 * kSpacing) > 12 * kSpacing ||
        std::abs(p.z - 15 * kSpacing) > 12 * kSpacing)
      continue;
    level_m += static_cast<double>(p.y);
    ++count;
    EXPECT_NEAR(p.y, 10 * kSpacing, 0.15F * kSpacing);  // ripples of the lattice
  }
  ASSERT_GT(count, 500);
  EXPECT_NEAR(level_m / count, 10 * static_cast<double>(kSpacing), 0.05 * static_cast<double>(kSpacing));
}

TEST(LiquidMesh, ADropIsABallAndNothingIsEmpty) {
  const std::vector<Vec3f> one{{0.1F, 0.2F, -0.3F}};
  const TriangleMesh mesh = liquid_mesh(one, kSpacing);
  EXPECT_TRUE(topology(mesh).closed_manifold());
  // Linear between nodes half a spacing apart: off by up to 0.5^2 / (8 x 0.545) spacings.
  for (const Vec3f p : mesh.positions_m) EXPECT_NEAR(length(p - one[0]), 0.545F * kSpacing, 0.06F * kSpacing);
  EXPECT_TRUE(liquid_mesh({}, kSpacing).triangles.empty());
}

}  // namespace
}  // namespace tactus
