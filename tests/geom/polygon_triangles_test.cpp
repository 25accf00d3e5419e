#include "tactus/geom/mesh/polygon_triangles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace tactus {
namespace {

std::vector<Vec3d> flat(const std::vector<Vec2d>& corners) {
  std::vector<Vec3d> points;
  for (const Vec2d c : corners) points.push_back({c.x, c.y, 0});
  return points;
}

/// Twice the area of the polygon, by the shoelace formula.
double shoelace(const std::vector<Vec3d>& p) {
  double sum = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const Vec3d a = p[i], b = p[(i + 1) % p.size()];
    sum += a.x * b.y - a.y * b.x;
  }
  return sum;
}

/// A triangulation of a simple polygon: n - 2 triangles, none turns the other way, areas add up to its area.
/// Then none overlap, as signed areas cover each point as often as the outline goes round it: once.
void expect_covers(const std::vector<Vec3d>& polygon) {
  std::int64_t tests = 1000000;
  std::vector<std::array<Index, 3>> triangles;
  ASSERT_TRUE(triangulate_polygon(polygon, tests, triangles));
  ASSERT_EQ(triangles.size(), polygon.size() - 2);
  const double whole = shoelace(polygon), sign = whole > 0 ? 1 : -1;
  double sum = 0;
  for (const auto& t : triangles) {
    std::vector<Vec3d> corners;
    for (const Index i : t) corners.push_back(polygon.at(static_cast<std::size_t>(i)));
    const double area = shoelace(corners);
    EXPECT_GE(sign * area, -1e-12 * std::abs(whole));  // corners on a line
    sum += area;
  }
  EXPECT_NEAR(sum, whole, 1e-12 * std::abs(whole));  // as many roundings as triangles, of numbers near 1
}

/// From every first corner, and the other way round.
void expect_covers_from_everywhere(std::vector<Vec3d> polygon) {
  for (int way = 0; way < 2; ++way) {
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      SCOPED_TRACE(k);
      expect_covers(polygon);
      std::rotate(polygon.begin(), polygon.begin() + 1, polygon.end());
    }
    std::reverse(polygon.begin(), polygon.end());
  }
}

TEST(PolygonTriangles, ConcaveOutlines) {
  expect_covers_from_everywhere(flat({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}));  // L
  expect_covers_from_everywhere(flat({{0, 0}, {2, 1}, {0, 2}, {0.3, 1}}));                // arrow
  expect_covers_from_everywhere(flat({{0, 0}, {3, 0}, {3, 3}, {2, 3}, {2, 1}, {1, 1}, {1, 3}, {0, 3}}));  // U
  expect_covers_from_everywhere(
      flat({{0, 0}, {1, 0}, {2, 0}, {2, 2}, {1, 2}, {1, 1}, {0, 1}}));  // T-junction
  // A square with a square hole, joined by a slit: two corners are there twice.
  expect_covers_from_everywhere(
      flat({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}}));
}

TEST(PolygonTriangles, RandomStars) {
  // Every polygon with growing angles around a point is simple.
  std::uint32_t state = 7;
  const auto random = [&] { return ((state = state * 1664525U + 1013904223U) >> 8) / double{1 << 24}; };
  for (const int n : {5, 17, 200}) {
    std::vector<Vec3d> star;
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * 3.14159265358979323846 * i / n, r = 0.1 + random();
      star.push_back({r * std::cos(angle), r * std::sin(angle), 0});
    }
    expect_covers(star);
  }
}

TEST(PolygonTriangles, ConvexOnesAreFans) {
  std::int64_t tests = 0;
  std::vector<std::array<Index, 3>> triangles;
  ASSERT_TRUE(triangulate_polygon(flat({{0, 0}, {2, 0}, {2, 1}, {1, 2}, {0, 1}}), tests, triangles));
  EXPECT_EQ(triangles, (std::vector<std::array<Index, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(PolygonTriangles, WhatCrossesItselfOrIsALineKeepsItsEdges) {
  for (const auto& corners :
       {flat({{0, 0}, {2, 2}, {2, 0}, {0, 2}, {-1, 1}}), flat({{0, 0}, {1, 0}, {3, 0}, {2, 0}}),
        flat({{1, 1}, {1, 1}, {1, 1}, {1, 1}})}) {
    std::int64_t tests = 1000;
    std::vector<std::array<Index, 3>> triangles;
    ASSERT_TRUE(triangulate_polygon(corners, tests, triangles));
    ASSERT_EQ(triangles.size(), corners.size() - 2);
    // Directed edges of the triangles that have no counterpart are those of the polygon.
    const auto n = static_cast<Index>(corners.size());
    std::vector<int> net(static_cast<std::size_t>(n * n));
    for (const auto& t : triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Index a = t.at(k), b = t.at((k + 1) % 3);
        ++net[static_cast<std::size_t>(a * n + b)];
        --net[static_cast<std::size_t>(b * n + a)];
      }
    }
    for (Index a = 0; a < n; ++a) {
      for (Index b = 0; b < n; ++b) {
        const int expected = b == (a + 1) % n ? 1 : (a == (b + 1) % n ? -1 : 0);
        EXPECT_EQ(net[static_cast<std::size_t>(a * n + b)], expected) << a << " to " << b;
      }
    }
  }
}

TEST(PolygonTriangles, TestsAreBounded) {
  std::vector<Vec2d> comb;  // half of its corners turn inwards
  for (int i = 0; i < 500; ++i) comb.push_back({double(i), i % 2 == 0 ? 0. : 5.});
  comb.push_back({499, 9});
  comb.push_back({0, 9});
  std::int64_t tests = 100;
  std::vector<std::array<Index, 3>> triangles;
  EXPECT_FALSE(triangulate_polygon(flat(comb), tests, triangles));
  EXPECT_TRUE(triangles.empty());
}

}  // namespace
}  // namespace tactus
