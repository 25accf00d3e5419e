/// Averages over a surface, and finer triangles on it.
#include "tactus/geom/mesh/surface_samples.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tactus/geom/mesh/refine_edges.h"
#include "tactus/geom/mesh/sphere_surface.h"

namespace tactus {
namespace {

/// A square of n x n cells in y = 0, whose inner vertices are moved along it by up to half a cell, so that
/// some triangles are slivers.
TriangleMesh uneven_plate(Index n) {
  TriangleMesh plate;
  std::uint32_t random = 7;
  const auto noise = [&] {
    random = random * 1664525U + 1013904223U;
    return static_cast<float>(random >> 8) / (1 << 24) - 0.5F;
  };
  for (Index k = 0; k < (n + 1) * (n + 1); ++k) {
    const Index i = k % (n + 1), j = k / (n + 1);
    const bool is_inner = i > 0 && i < n && j > 0 && j < n;
    const Vec3f off = is_inner ? Vec3f{0.9F * noise(), 0, 0.9F * noise()} : Vec3f{};
    plate.positions_m.push_back(Vec3f{static_cast<float>(i), 0, static_cast<float>(j)} + off);
    plate.normals.push_back({0, 1, 0});
  }
  for (Index j = 0; j < n; ++j)
    for (Index i = 0; i < n; ++i) {
      const Index a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      plate.triangles.push_back({a, c, b});
      plate.triangles.push_back({b, c, d});
    }
  return plate;
}

constexpr Box3f kAll{{-1e6F, -1e6F, -1e6F}, {1e6F, 1e6F, 1e6F}};

/// The weights (1 - d^2 / R^2)^3 of a plane sum to pi R^2 / 4, less by 1 - 0.2 as all face one way. Samples
/// stand for squares of at most 0.4 R: such a sum is within 3 % of it. Their gradients cancel likewise.
TEST(SurfaceSamples, WeightsSumUpToThePlanes) {
  const TriangleMesh plate = uneven_plate(20);
  const SurfaceSamples samples(plate, 3, kAll);
  for (const Vec3f p : {Vec3f{10, 0, 10}, Vec3f{7.3F, 0, 11.1F}}) {
    double sum = 0;
    Vec3f slope{};
    samples.around(p, {0, 1, 0}, [&](const SurfaceSamples::Sample&, float weight, Vec3f gradient) {
      sum += double{weight};
      slope += gradient;
    });
    const double exact = 0.8 * 3.14159265 * 9 / 4;
    EXPECT_NEAR(sum, exact, 0.03 * exact);
    EXPECT_LT(length(slope), 0.05 * exact);
  }
}

/// The gradient is that of the weight: a step of 1e-3 R changes the sum by it within the float's rounding.
TEST(SurfaceSamples, TheGradientIsTheWeights) {
  const TriangleMesh plate = uneven_plate(20);
  const SurfaceSamples samples(plate, 3, kAll);
  // Of the half x > 10 alone, so that the sum has a slope.
  const auto half = [&](float x, Vec3f& slope) {
    double sum = 0;
    slope = {};
    samples.around({x, 0, 10}, {0, 1, 0}, [&](const SurfaceSamples::Sample& s, float weight, Vec3f gradient) {
      if (s.x_m.x <= 10) return;
      sum += double{weight};
      slope += gradient;
    });
    return sum;
  };
  Vec3f slope{}, ignored{};
  half(10.2F, slope);
  const double step = 3e-2;
  const double difference =
      (half(10.2F + static_cast<float>(step), ignored) - half(10.2F - static_cast<float>(step), ignored)) /
      2 / step;
  EXPECT_NEAR(double{slope.x}, difference, 0.01 * difference);
}

TEST(SurfaceSamples, TheOtherSideOfASheetDoesNotCount) {
  TriangleMesh sheet = uneven_plate(8);
  const auto count = static_cast<Index>(sheet.positions_m.size());
  const std::size_t triangles = sheet.triangles.size();
  for (Index v = 0; v < count; ++v)
    sheet.positions_m.push_back(sheet.positions_m[static_cast<std::size_t>(v)] - Vec3f{0, 0.1F, 0});
  for (std::size_t t = 0; t < triangles; ++t) {
    const auto [a, b, c] = sheet.triangles[t];
    sheet.triangles.push_back({a + count, c + count, b + count});
  }
  const SurfaceSamples samples(sheet, 2, kAll);
  samples.around({4, 0, 4}, {0, 1, 0},
                 [&](const SurfaceSamples::Sample& s, float, Vec3f) { EXPECT_EQ(s.x_m.y, 0); });
}

/// All edges of a sphere of 12 rings halved: new vertices lie on the sphere, nearer to it than the middles of
/// chords by an order. The surface stays closed.
TEST(RefineEdges, ARoundSurfaceStaysRound) {
  TriangleMesh ball = sphere_surface(1, 12);
  compute_normals(ball);
  for (std::size_t v = 0; v < ball.normals.size(); ++v) ball.normals[v] = normalized(ball.positions_m[v]);
  const MeshTopology before = topology(ball);
  const double area = area_m2(ball);
  std::vector<std::uint8_t> is_crease(ball.positions_m.size());
  const std::size_t first = ball.positions_m.size();
  double chords = 0, curves = 0;
  const TriangleMesh old = ball;
  const EdgeRefinement made = refine_edges(ball, is_crease, [](Index, Index) { return true; });
  ASSERT_EQ(ball.positions_m.size(), first + made.ends.size());
  for (std::size_t k = 0; k < made.ends.size(); ++k) {
    const auto [a, b] = made.ends[k];
    const Vec3f from = old.positions_m[static_cast<std::size_t>(a)],
                to = old.positions_m[static_cast<std::size_t>(b)];
    const float radius = 0.5F * (length(from) + length(to));
    chords += std::abs(double{radius - length(0.5F * (from + to))});
    curves += std::abs(double{radius - length(ball.positions_m[first + k])});
  }
  EXPECT_LT(curves, 0.1 * chords);
  const MeshTopology after = topology(ball);
  EXPECT_TRUE(after.closed_manifold());
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_EQ(ball.triangles.size(), 4 * old.triangles.size());
  EXPECT_GT(area_m2(ball), area);
}

/// Whichever edges are halved, triangles fit together, and parts know their parents.
TEST(RefineEdges, SomeEdgesHalvedStillFit) {
  for (const int every : {2, 3, 5}) {
    TriangleMesh ball = sphere_surface(1, 8);
    compute_normals(ball);
    const TriangleMesh old = ball;
    std::vector<std::uint8_t> is_crease(ball.positions_m.size(), 1);  // new vertices lie on chords
    const EdgeRefinement made =
        refine_edges(ball, is_crease, [&](Index a, Index b) { return (a + 7 * b) % every == 0; });
    EXPECT_TRUE(topology(ball).closed_manifold());
    EXPECT_NEAR(volume_m3(ball), volume_m3(old), 1e-5);
    ASSERT_EQ(made.parent.size(), ball.triangles.size());
    const auto normal = [](const TriangleMesh& mesh, std::size_t t) {
      const auto p = [&](std::size_t k) {
        return mesh.positions_m[static_cast<std::size_t>(mesh.triangles[t].at(k))];
      };
      return normalized(cross(p(1) - p(0), p(2) - p(0)));
    };
    for (std::size_t t = 0; t < ball.triangles.size(); ++t)
      EXPECT_GT(dot(normal(ball, t), normal(old, static_cast<std::size_t>(made.parent[t]))), 0.999F);
  }
}

}  // namespace
}  // namespace tactus
