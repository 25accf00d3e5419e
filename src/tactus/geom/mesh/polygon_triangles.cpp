#include "tactus/geom/mesh/polygon_triangles.h"

#include <cmath>

#include "tactus/base/at.h"

namespace tactus {
namespace {

struct Point {
  double x, y;
  bool operator==(const Point&) const = default;
};

/// Twice the area of a triangle, positive where it turns to the left.
double turn(Point a, Point b, Point c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

/// Newell's normal: twice the area, whatever the corners are.
Vec3d newell_normal(std::span<const Vec3d> corners) {
  Vec3d n{};
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    n = n + cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
  return n;
}

/// Onto the plane of two axes in which the polygon is largest, turning to the left.
std::vector<Point> flattened(std::span<const Vec3d> corners, Vec3d n) {
  const Vec3d size{std::abs(n.x), std::abs(n.y), std::abs(n.z)};
  const int axis = size.z >= size.x && size.z >= size.y ? 2 : (size.y >= size.x ? 1 : 0);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::vector<Point> points;
  points.reserve(corners.size());
  for (const Vec3d c : corners) {
    const Vec3d p = c - corners[0];
    points.push_back(n[axis] < 0 ? Point{p[v], p[u]} : Point{p[u], p[v]});
  }
  return points;
}

class EarClipper {
 public:
  EarClipper(const std::vector<Point>& points, double flat, std::int64_t& tests)
      : p_(points), flat_(flat), tests_(tests), next_(points.size()), before_(points.size()) {
    const auto n = static_cast<Index>(points.size());
    for (Index i = 0; i < n; ++i) {
      next_[at(i)] = (i + 1) % n;
      before_[at(i)] = (i + n - 1) % n;
    }
    is_there_.assign(points.size(), 1);
    for (Index i = 0; i < n; ++i) {
      if (turn_at(i) <= flat_) hollow_.push_back(i);
    }
  }

  /// @return false: too many tests
  bool clip(std::vector<std::array<Index, 3>>& triangles) {
    Index left = static_cast<Index>(p_.size()), i = 0;
    for (Index tried = 0; left > 3;) {
      if (tests_ < 0) return false;
      if (tried < left && !is_ear(i)) {
        i = next_[at(i)];
        ++tried;
        continue;
      }
      // A polygon that crosses itself or has no area may have no ear: any corner goes then.
      triangles.push_back({before_[at(i)], i, next_[at(i)]});
      const Index before = before_[at(i)], next = next_[at(i)];
      next_[at(before)] = next;
      before_[at(next)] = before;
      is_there_[at(i)] = 0;
      --left;
      tried = 0;
      i = next_[at(next)];  // every second corner: slimmer fans
    }
    triangles.push_back({before_[at(i)], i, next_[at(i)]});
    return true;
  }

 private:
  double turn_at(Index i) const { return turn(p_[at(before_[at(i)])], p_[at(i)], p_[at(next_[at(i)])]); }

  /// Corners at which the polygon turns to the right or goes straight on stand in a list. Clipping only makes
  /// corners more convex, so the list only shrinks.
  bool is_ear(Index i) {
    --tests_;
    if (turn_at(i) <= flat_) return false;
    const Point a = p_[at(before_[at(i)])], b = p_[at(i)], c = p_[at(next_[at(i)])];
    for (std::size_t k = 0; k < hollow_.size();) {
      const Index h = hollow_[k];
      if (!is_there_[at(h)] || turn_at(h) > flat_) {
        hollow_[k] = hollow_.back();
        hollow_.pop_back();
        continue;
      }
      ++k;
      --tests_;
      const Point q = p_[at(h)];
      if (q == a || q == b || q == c) continue;
      if (turn(a, b, q) >= 0 && turn(b, c, q) >= 0 && turn(c, a, q) >= 0) return false;
    }
    return true;
  }

  const std::vector<Point>& p_;
  double flat_;
  std::int64_t& tests_;
  std::vector<Index> next_, before_, hollow_;
  std::vector<char> is_there_;
};

}  // namespace

bool triangulate_polygon(std::span<const Vec3d> corners, std::int64_t& tests,
                         std::vector<std::array<Index, 3>>& triangles) {
  const Vec3d normal = newell_normal(corners);
  const std::vector<Point> p = flattened(corners, normal);
  const double flat = 1e-12 * length(normal);  // rounding of corners on a line
  const auto n = static_cast<Index>(p.size());
  bool fan = true;
  for (Index i = 2; i < n && fan; ++i) fan = turn(p[0], p[at(i - 1)], p[at(i)]) >= -flat;
  if (fan) {
    for (Index i = 2; i < n; ++i) triangles.push_back({0, i - 1, i});
    return true;
  }
  const std::size_t before = triangles.size();
  if (EarClipper(p, flat, tests).clip(triangles)) return true;
  triangles.resize(before);
  return false;
}

}  // namespace tactus
