#include "tactus/tissue/cut/triangulate.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tactus::cut {
namespace {

using Polygon = std::vector<int>;  ///< counter-clockwise; a slit is gone along both ways

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

class Outline {
 public:
  explicit Outline(const DividedTriangle& divided) : points_(divided.points), unused_(divided.segments) {
    Polygon outline;
    for (int k = 0; k < 3; ++k) {
      outline.push_back(k);
      outline.insert(outline.end(), divided.on_edge[at(k)].begin(), divided.on_edge[at(k)].end());
    }
    polygons_.push_back(std::move(outline));
  }

  std::vector<std::array<int, 3>> triangles() {
    while (!unused_.empty())
      if (!follow_chain()) reach_chain();
    std::vector<std::array<int, 3>> found;
    for (Polygon& polygon : polygons_) clip_ears(std::move(polygon), found);
    return found;
  }

 private:
  /// Twice the area of abc, positive where it turns left.
  double turn(int a, int b, int c) const {
    const Vec2d u = points_[at(b)] - points_[at(a)], v = points_[at(c)] - points_[at(a)];
    return u.x * v.y - u.y * v.x;
  }
  double square(int a, int b) const {
    const Vec2d d = points_[at(b)] - points_[at(a)];
    return d.x * d.x + d.y * d.y;
  }
  /// Takes a segment at a point out of the list. @returns its other end, or -1
  int take_segment(int from) {
    for (std::size_t s = 0; s < unused_.size(); ++s) {
      const auto [a, b] = unused_[s];
      if (a != from && b != from) continue;
      unused_.erase(unused_.begin() + static_cast<std::ptrdiff_t>(s));
      return a == from ? b : a;
    }
    return -1;
  }
  /// Whether the way to p begins inside, at place i of a polygon.
  bool looks_inside(const Polygon& polygon, std::size_t i, int p) const {
    const int v = polygon[i], next = polygon[(i + 1) % polygon.size()],
              last = polygon[(i + polygon.size() - 1) % polygon.size()];
    const bool after = turn(v, next, p) > 0, before = turn(v, p, last) > 0;
    return turn(v, next, last) > 0 || next == last ? (after && before) || next == last : after || before;
  }
  static std::size_t place(const Polygon& polygon, int point) {
    return static_cast<std::size_t>(std::find(polygon.begin(), polygon.end(), point) - polygon.begin());
  }

  /// Divides a polygon along segments that begin at one of its points. @returns false: there are none
  bool follow_chain() {
    std::size_t of = 0, from = 0;
    int found = 0;  // 2: one that begins inside
    for (const auto& segment : unused_) {
      for (std::size_t k = 0; k < polygons_.size() && found < 2; ++k)
        for (std::size_t i = 0; i < polygons_[k].size() && found < 2; ++i)
          for (const std::size_t end : {0U, 1U}) {
            if (polygons_[k][i] != segment[end]) continue;
            const int value = looks_inside(polygons_[k], i, segment[1 - end]) ? 2 : 1;
            if (value > found) found = value, of = k, from = i;
          }
      if (found > 0) break;
    }
    if (found == 0) return false;
    Polygon& polygon = polygons_[of];
    std::vector<int> chain;
    int to = take_segment(polygon[from]);
    while (to >= 0 && place(polygon, to) == polygon.size() &&
           std::find(chain.begin(), chain.end(), to) == chain.end()) {
      chain.push_back(to);
      to = take_segment(to);
    }
    divide(of, from, chain, to >= 0 ? place(polygon, to) : polygon.size());
    return true;
  }
  /// @param to place where the chain ends; the polygon's size: inside, as a slit
  void divide(std::size_t of, std::size_t from, const std::vector<int>& chain, std::size_t to) {
    const Polygon old = polygons_[of];
    const std::size_t n = old.size();
    Polygon left, right;  // of the chain
    if (to >= n) {
      left.assign(old.begin(), old.begin() + static_cast<std::ptrdiff_t>(from) + 1);
      left.insert(left.end(), chain.begin(), chain.end());
      if (!chain.empty()) left.insert(left.end(), chain.rbegin() + 1, chain.rend());
      if (!chain.empty()) left.insert(left.end(), old.begin() + static_cast<std::ptrdiff_t>(from), old.end());
      if (!chain.empty()) polygons_[of] = left;
      return;
    }
    if (to == from) {  // a loop
      left = chain;
      left.push_back(old[from]);
      Polygon way = chain;
      if (area(left) > 0)
        std::reverse(way.begin(), way.end());
      else
        std::reverse(left.begin(), left.end());
      right.assign(old.begin(), old.begin() + static_cast<std::ptrdiff_t>(from) + 1);
      right.insert(right.end(), way.begin(), way.end());
      right.insert(right.end(), old.begin() + static_cast<std::ptrdiff_t>(from), old.end());
    } else {
      for (std::size_t i = to; i != from; i = (i + 1) % n) left.push_back(old[i]);
      left.push_back(old[from]);
      left.insert(left.end(), chain.begin(), chain.end());
      for (std::size_t i = from; i != to; i = (i + 1) % n) right.push_back(old[i]);
      right.push_back(old[to]);
      right.insert(right.end(), chain.rbegin(), chain.rend());
    }
    polygons_[of] = std::move(left);
    polygons_.push_back(std::move(right));
  }
  double area(const Polygon& polygon) const {
    double sum = 0;
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) sum += turn(polygon[0], polygon[i], polygon[i + 1]);
    return sum;
  }
  bool holds(const Polygon& polygon, int p) const {
    bool is_inside = false;
    const Vec2d o = points_[at(p)];
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2d a = points_[at(polygon[i])], b = points_[at(polygon[(i + 1) % polygon.size()])];
      if ((a.y > o.y) != (b.y > o.y) && o.x < a.x + (o.y - a.y) / (b.y - a.y) * (b.x - a.x))
        is_inside = !is_inside;
    }
    return is_inside;
  }
  /// A slit without a segment leads from the nearest outline to segments that lie inside.
  void reach_chain() {
    const int target = unused_.front()[0];
    std::size_t of = 0;
    for (std::size_t k = 0; k < polygons_.size(); ++k)
      if (holds(polygons_[k], target)) of = k;
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < polygons_[of].size(); ++i)
      if (square(polygons_[of][i], target) < square(polygons_[of][nearest], target)) nearest = i;
    divide(of, nearest, {target}, polygons_[of].size());
  }

  /// How good an ear is at place i: its area over its edges; negative: it turns right or holds a point.
  double ear(const Polygon& polygon, std::size_t i) const {
    const std::size_t n = polygon.size();
    const int a = polygon[(i + n - 1) % n], b = polygon[i], c = polygon[(i + 1) % n];
    if (a == c || a == b || b == c) return -std::numeric_limits<double>::infinity();
    const double size = turn(a, b, c) / (square(a, b) + square(b, c) + square(c, a));
    if (!(size > 0)) return size - 1;
    for (const int p : polygon) {
      if (p == a || p == b || p == c) continue;
      if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return size - 10;
    }
    return size;
  }
  void clip_ears(Polygon polygon, std::vector<std::array<int, 3>>& found) const {
    while (polygon.size() >= 3) {
      std::size_t best = 0;
      double most = -std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < polygon.size(); ++i)
        if (const double quality = ear(polygon, i); quality > most) most = quality, best = i;
      const std::size_t n = polygon.size();
      const int a = polygon[(best + n - 1) % n], b = polygon[best], c = polygon[(best + 1) % n];
      if (a != c && a != b && b != c) found.push_back({a, b, c});
      polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(best));
    }
  }

  const std::vector<Vec2d>& points_;
  std::vector<std::array<int, 2>> unused_;  ///< segments
  std::vector<Polygon> polygons_;
};

}  // namespace

std::vector<std::array<int, 3>> triangulate(const DividedTriangle& divided) {
  return Outline(divided).triangles();
}

}  // namespace tactus::cut
