#include "tactus/tissue/cut/triangulate.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactus::cut {
namespace {

class Triangulation {
 public:
  explicit Triangulation(const std::vector<Vec2d>& points) : points_(points), triangles_{{0, 1, 2}} {}

  /// Puts a point on the edge from a to b, of the triangle that has it in this direction.
  void split_edge(int a, int b, int point) {
    const Edge edge = find(a, b);
    if (edge.triangle < 0) return;
    const int c = edge.opposite;
    triangles_[at(edge.triangle)] = {a, point, c};
    triangles_.push_back({point, b, c});
  }
  /// Puts a point into the triangle that holds it best.
  void add(int point) {
    int best = 0;
    double most = -std::numeric_limits<double>::infinity();
    for (int t = 0; t < static_cast<int>(triangles_.size()); ++t) {
      const auto [a, b, c] = triangles_[at(t)];
      const double least = std::min({turn(a, b, point), turn(b, c, point), turn(c, a, point)});
      if (least > most) most = least, best = t;
    }
    // What lies on an edge divides it: points of a straight line would make flat triangles.
    for (std::size_t k = 0; k < 3; ++k) {
      const int u = triangles_[at(best)][k], v = triangles_[at(best)][(k + 1) % 3];
      const Vec2d uv = points_[at(v)] - points_[at(u)];
      const double height = turn(u, v, point) / std::sqrt(uv.x * uv.x + uv.y * uv.y);
      if (height > kOnEdge || find(v, u).triangle < 0) continue;
      split_edge(u, v, point);
      split_edge(v, u, point);
      return;
    }
    const auto [a, b, c] = triangles_[at(best)];
    triangles_[at(best)] = {a, b, point};
    triangles_.push_back({b, c, point});
    triangles_.push_back({c, a, point});
  }
  /// Flips edges until there is one from a to b.
  void join(int a, int b) {
    for (int round = 0; round < 200; ++round) {
      if (find(a, b).triangle >= 0 || find(b, a).triangle >= 0 || !flip_one(a, b, round)) return;
    }
  }
  /// Flips edges until no triangle's circle holds its neighbour's corner (Lawson 1977), so that points of a
  /// straight line make no flat triangles. Segments stay.
  void round_off(const std::vector<std::array<int, 2>>& segments) {
    for (int round = 0; round < 20; ++round) {
      bool changes = false;
      for (int k = 0; k < 3 * static_cast<int>(triangles_.size()); ++k) changes = flip_flat(k, segments) || changes;
      if (!changes) return;
    }
  }
  std::vector<std::array<int, 3>> take() { return std::move(triangles_); }

 private:
  struct Edge {
    int triangle = -1, opposite = -1;
  };
  static constexpr double kOnEdge = 1e-10;
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  /// Twice the area of abc, positive where it turns left.
  double turn(int a, int b, int c) const {
    const Vec2d u = points_[at(b)] - points_[at(a)], v = points_[at(c)] - points_[at(a)];
    return u.x * v.y - u.y * v.x;
  }
  Edge find(int a, int b) const {
    for (int t = 0; t < static_cast<int>(triangles_.size()); ++t)
      for (std::size_t k = 0; k < 3; ++k)
        if (triangles_[at(t)][k] == a && triangles_[at(t)][(k + 1) % 3] == b)
          return {t, triangles_[at(t)][(k + 2) % 3]};
    return {};
  }
  bool flip_flat(int k, const std::vector<std::array<int, 2>>& segments) {
    const auto& t = triangles_[at(k / 3)];
    const int u = t[at(k % 3)], v = t[at((k + 1) % 3)], w = t[at((k + 2) % 3)];
    const Edge other = find(v, u);
    if (other.triangle < 0) return false;
    const auto is_uv = [&](const std::array<int, 2>& s) { return (s[0] == u && s[1] == v) || (s[0] == v && s[1] == u); };
    const int z = other.opposite;
    const Vec2d uv = points_[at(v)] - points_[at(u)];
    const bool is_flat = turn(u, v, w) <= 1e-12 * (uv.x * uv.x + uv.y * uv.y);
    if (!(turn(z, v, w) > 0) || !(turn(w, u, z) > 0) || !(is_flat || is_in_circle(u, v, w, z)) ||
        std::any_of(segments.begin(), segments.end(), is_uv))
      return false;
    triangles_[at(k / 3)] = {z, v, w};
    triangles_[at(other.triangle)] = {w, u, z};
    return true;
  }
  /// Whether z lies in the circle through u, v and w.
  bool is_in_circle(int u, int v, int w, int z) const {
    const auto from_z = [&](int i) { return points_[at(i)] - points_[at(z)]; };
    const Vec2d a = from_z(u), b = from_z(v), c = from_z(w);
    const auto square = [](Vec2d p) { return p.x * p.x + p.y * p.y; };
    const auto det = [](Vec2d p, Vec2d q) { return p.x * q.y - p.y * q.x; };
    return square(a) * det(b, c) + square(b) * det(c, a) + square(c) * det(a, b) > 0;
  }
  /// Of the edges that cross ab the first that can be flipped, beginning elsewhere in every round.
  bool flip_one(int a, int b, int round) {
    const int n = 3 * static_cast<int>(triangles_.size());
    for (int i = 0; i < n; ++i) {
      const int k = (i + 7 * round) % n;
      const auto& t = triangles_[at(k / 3)];
      const int u = t[at(k % 3)], v = t[at((k + 1) % 3)], w = t[at((k + 2) % 3)];
      if (u == a || u == b || v == a || v == b) continue;
      if ((turn(a, b, u) > 0) == (turn(a, b, v) > 0) || (turn(u, v, a) > 0) == (turn(u, v, b) > 0)) continue;
      const Edge other = find(v, u);
      if (other.triangle < 0) continue;
      const int z = other.opposite;
      if (!(turn(z, v, w) > 0) || !(turn(w, u, z) > 0)) continue;
      const int first = k / 3;
      triangles_[at(first)] = {z, v, w};
      triangles_[at(other.triangle)] = {w, u, z};
      return true;
    }
    return false;
  }

  const std::vector<Vec2d>& points_;
  std::vector<std::array<int, 3>> triangles_;
};

}  // namespace

std::vector<std::array<int, 3>> triangulate(const DividedTriangle& divided) {
  Triangulation triangles(divided.points);
  for (int k = 0; k < 3; ++k) {
    int from = k;
    for (const int point : divided.on_edge[static_cast<std::size_t>(k)]) {
      triangles.split_edge(from, (k + 1) % 3, point);
      from = point;
    }
  }
  for (const int point : divided.inside) triangles.add(point);
  triangles.round_off({});
  for (const auto& [a, b] : divided.segments) triangles.join(a, b);
  triangles.round_off(divided.segments);
  return triangles.take();
}

}  // namespace tactus::cut
