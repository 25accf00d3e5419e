#include "tactus/tissue/cut/triangulate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "tactus/base/at.h"

namespace tactus::cut {
namespace {

using Polygon = std::span<const int>;  ///< counter-clockwise; a slit is gone along both ways

class Outline {
 public:
  explicit Outline(const DividedTriangle& divided) : points_(divided.points), unused_(divided.segments) {
    for (int k = 0; k < 3; ++k) {
      corners_.push_back(k);
      corners_.append(divided.on_edge[at(k)].begin(), divided.on_edge[at(k)].end());
    }
    polygons_.push_back({0, corners_.size()});
  }

  void triangles(ShortList<std::array<int, 3>, 16>& found) {
    while (!unused_.empty())
      if (!follow_chain()) reach_chain();
    for (std::size_t k = 0; k < polygons_.size(); ++k) clip_ears(polygon(k), found);
  }

 private:
  using Chain = ShortList<int, 8>;
  /// Places in corners_.
  struct Range {
    std::size_t first, count;
  };
  Polygon polygon(std::size_t k) const { return {corners_.begin() + polygons_[k].first, polygons_[k].count}; }
  static std::size_t after(std::size_t i, std::size_t n) { return i + 1 < n ? i + 1 : 0; }
  static std::size_t before(std::size_t i, std::size_t n) { return (i > 0 ? i : n) - 1; }
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
      unused_.erase(s);
      return a == from ? b : a;
    }
    return -1;
  }
  /// Whether the way to p begins inside, at place i of a polygon.
  bool looks_inside(Polygon polygon, std::size_t i, int p) const {
    const int v = polygon[i], next = polygon[after(i, polygon.size())],
              last = polygon[before(i, polygon.size())];
    const bool after = turn(v, next, p) > 0, before = turn(v, p, last) > 0;
    return turn(v, next, last) > 0 || next == last ? (after && before) || next == last : after || before;
  }
  static std::size_t place(Polygon polygon, int point) {
    return static_cast<std::size_t>(std::find(polygon.begin(), polygon.end(), point) - polygon.begin());
  }

  /// Divides a polygon along segments that begin at one of its points. @returns false: there are none
  bool follow_chain() {
    std::size_t of = 0, from = 0;
    int found = 0;  // 2: one that begins inside
    for (const auto& segment : unused_) {
      for (std::size_t k = 0; k < polygons_.size() && found < 2; ++k)
        for (std::size_t i = 0; i < polygons_[k].count && found < 2; ++i)
          for (const std::size_t end : {0U, 1U}) {
            if (polygon(k)[i] != segment[end]) continue;
            const int value = looks_inside(polygon(k), i, segment[1 - end]) ? 2 : 1;
            if (value > found) found = value, of = k, from = i;
          }
      if (found > 0) break;
    }
    if (found == 0) return false;
    Chain chain;
    int to = take_segment(polygon(of)[from]);
    while (to >= 0 && place(polygon(of), to) == polygon(of).size() &&
           std::find(chain.begin(), chain.end(), to) == chain.end()) {
      chain.push_back(to);
      to = take_segment(to);
    }
    divide(of, from, chain, to >= 0 ? place(polygon(of), to) : polygon(of).size());
    return true;
  }

  /// New polygons are put together behind the old ones.
  void push(int point) { corners_.push_back(point); }
  void push_range(std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) push(corners_[i]);
  }
  void push(const Chain& chain) { corners_.append(chain.begin(), chain.end()); }
  void push_back_to_front(const Chain& chain, std::size_t but_last = 0) {
    for (std::size_t i = chain.size() - but_last; i-- > 0;) push(chain[i]);
  }
  /// Range of the points pushed since `first`.
  Range pushed(std::size_t first) const { return {first, corners_.size() - first}; }

  /// @param to place where the chain ends; the polygon's size: inside, as a slit
  void divide(std::size_t of, std::size_t from, const Chain& chain, std::size_t to) {
    const auto [old, n] = polygons_[of];
    std::size_t first = corners_.size();
    if (to >= n) {
      if (chain.empty()) return;
      push_range(old, old + from + 1);
      push(chain);
      push_back_to_front(chain, 1);
      push_range(old + from, old + n);
      polygons_[of] = pushed(first);
      return;
    }
    if (to == from) {  // a loop
      push(chain);
      push(corners_[old + from]);
      const bool is_left = area(Polygon(corners_.begin() + first, corners_.end())) > 0;
      if (!is_left) std::reverse(corners_.begin() + first, corners_.end());
      polygons_[of] = pushed(first);
      first = corners_.size();
      push_range(old, old + from + 1);
      if (is_left)
        push_back_to_front(chain);
      else
        push(chain);
      push_range(old + from, old + n);
    } else {
      for (std::size_t i = to; i != from; i = after(i, n)) push(corners_[old + i]);
      push(corners_[old + from]);
      push(chain);
      polygons_[of] = pushed(first);
      first = corners_.size();
      for (std::size_t i = from; i != to; i = after(i, n)) push(corners_[old + i]);
      push(corners_[old + to]);
      push_back_to_front(chain);
    }
    polygons_.push_back(pushed(first));
  }
  double area(Polygon polygon) const {
    double sum = 0;
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) sum += turn(polygon[0], polygon[i], polygon[i + 1]);
    return sum;
  }
  bool holds(Polygon polygon, int p) const {
    bool is_inside = false;
    const Vec2d o = points_[at(p)];
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2d a = points_[at(polygon[i])], b = points_[at(polygon[after(i, polygon.size())])];
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
      if (holds(polygon(k), target)) of = k;
    const Polygon around = polygon(of);
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < around.size(); ++i)
      if (square(around[i], target) < square(around[nearest], target)) nearest = i;
    Chain chain;
    chain.push_back(target);
    divide(of, nearest, chain, around.size());
  }

  static constexpr double kTurnsRight = -1, kHoldsPoint = -10;
  /// How good an ear is at place i: its area over its edges; negative: it turns right or holds a point.
  double ear(Polygon polygon, std::size_t i) const {
    const std::size_t n = polygon.size();
    const int a = polygon[before(i, n)], b = polygon[i], c = polygon[after(i, n)];
    if (a == c || a == b || b == c) return -std::numeric_limits<double>::infinity();
    const double size = turn(a, b, c) / (square(a, b) + square(b, c) + square(c, a));
    if (!(size > 0)) return size + kTurnsRight;
    for (const int p : polygon) {
      if (p == a || p == b || p == c) continue;
      if (turn(a, b, p) >= 0 && turn(b, c, p) >= 0 && turn(c, a, p) >= 0) return size + kHoldsPoint;
    }
    return size;
  }
  static bool holds_point(double ear) { return ear > 2 * kHoldsPoint && ear < kHoldsPoint / 2; }

  /// Without a corner, its neighbours are other ears, and ears that held a point may hold it no more.
  void clip_ears(Polygon whole, ShortList<std::array<int, 3>, 16>& found) const {
    ShortList<int, 24> polygon;
    ShortList<double, 24> ears;
    polygon.assign(whole.begin(), whole.end());
    const auto left = [&] { return Polygon(polygon.begin(), polygon.end()); };
    for (std::size_t i = 0; i < whole.size(); ++i) ears.push_back(ear(whole, i));
    while (polygon.size() >= 3) {
      std::size_t best = 0, n = polygon.size();
      double most = -std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < n; ++i)
        if (ears[i] > most) most = ears[i], best = i;
      const int a = polygon[before(best, n)], b = polygon[best], c = polygon[after(best, n)];
      if (a != c && a != b && b != c) found.push_back({a, b, c});
      polygon.erase(best);
      ears.erase(best);
      if (--n < 3) break;
      const std::size_t next = best < n ? best : 0, last = before(next, n);
      for (std::size_t i = 0; i < n; ++i)
        if (i == next || i == last || holds_point(ears[i])) ears[i] = ear(left(), i);
    }
  }

  const ShortList<Vec2d, 16>& points_;
  ShortList<std::array<int, 2>, 8> unused_;  ///< segments
  ShortList<int, 64> corners_;               ///< of polygons, also of those that were divided
  ShortList<Range, 8> polygons_;
};

}  // namespace

void triangulate(const DividedTriangle& divided, ShortList<std::array<int, 3>, 16>& found) {
  Outline(divided).triangles(found);
}

}  // namespace tactus::cut
