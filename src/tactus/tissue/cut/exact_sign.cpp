#include "tactus/tissue/cut/exact_sign.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/at.h"

namespace tactus::cut {
namespace {

/// A sum without rounding: parts that do not overlap, ascending (Shewchuk 1997, GROW-EXPANSION).
class ExactSum {
 public:
  void add(double value) {
    int kept = 0;
    for (int i = 0; i < count_; ++i) {
      const double part = parts_[at(i)], sum = value + part, of_part = sum - value;
      const double error = (value - (sum - of_part)) + (part - of_part);
      if (error != 0) parts_[at(kept++)] = error;
      value = sum;
    }
    if (value != 0 || kept == 0) parts_[at(kept++)] = value;
    count_ = kept;
  }
  /// Adds the product of three floats: that of two is exact in double.
  void add_product(double a, double b, double c) {
    const double ab = a * b, abc = ab * c;
    add(abc);
    add(std::fma(ab, c, -abc));
  }
  int sign() const {
    const double top = count_ > 0 ? parts_[at(count_ - 1)] : 0;
    return top > 0 ? 1 : top < 0 ? -1 : 0;
  }

 private:
  std::array<double, 64> parts_{};  ///< 24 products of two parts each
  int count_ = 0;
};

using Points = std::array<NamedPoint, 4>;

/// Column 3 of the matrix is 1.
double entry(const Points& p, int row, int column) {
  return column < 3 ? static_cast<double>(p[static_cast<std::size_t>(row)].x_m[column]) : 1.0;
}

/// Sign of the minor of [x y z 1] without some rows and columns: the sum over permutations.
int minor_sign(const Points& p, unsigned rows, unsigned columns) {
  int row[4], count = 0;
  for (int r = 0; r < 4; ++r)
    if ((rows >> r & 1U) != 0) row[count++] = r;
  int column[4], n = 0;
  for (int c = 0; c < 4; ++c)
    if ((columns >> c & 1U) != 0) column[n++] = c;
  ExactSum sum;
  int order[4] = {0, 1, 2, 3};
  do {
    double factor[3] = {1, 1, 1};
    int used = 0, inversions = 0;
    for (int i = 0; i < count; ++i) {
      for (int j = i + 1; j < count; ++j) inversions += order[i] > order[j] ? 1 : 0;
      if (column[order[i]] < 3) factor[used++] = entry(p, row[i], column[order[i]]);
    }
    sum.add_product(inversions % 2 != 0 ? -factor[0] : factor[0], factor[1], factor[2]);
  } while (std::next_permutation(order, order + count));
  return sum.sign();
}

/// Sign of det [x y z 1] with rows in ascending order of ids, moved symbolically: entry (i, j) by
/// e^(2^(3 i + j)). The first coefficient that is not 0 decides; products of moved entries are the bits of a
/// counter.
int moved_sign(const Points& p) {
  for (unsigned moved = 0; moved < 1U << 12U; ++moved) {
    unsigned rows = 15, columns = 15;
    bool is_product = true;
    int sign = 1;
    for (int i = 0; i < 4 && is_product; ++i) {
      for (int j = 0; j < 3; ++j) {
        if ((moved >> (3 * i + j) & 1U) == 0) continue;
        if ((rows >> i & 1U) == 0 || (columns >> j & 1U) == 0) {
          is_product = false;
          break;
        }
        // The cofactor's sign, by places among the rows and columns that are left.
        int place = 0;
        for (int r = 0; r < i; ++r) place += (rows >> r & 1U) != 0 ? 1 : 0;
        for (int c = 0; c < j; ++c) place += (columns >> c & 1U) != 0 ? 1 : 0;
        if (place % 2 != 0) sign = -sign;
        rows &= ~(1U << i);
        columns &= ~(1U << j);
      }
    }
    if (!is_product) continue;
    if (const int s = minor_sign(p, rows, columns); s != 0) return s * sign;
  }
  return 1;  // not reached: the product of three moved entries has the coefficient 1
}

double size(Vec3d p) { return std::abs(p.x) + std::abs(p.y) + std::abs(p.z); }

/// Each of 6 products of a determinant is rounded by some 2^-53, six times at most; 16 times that is on the
/// safe side.
constexpr double kUncertain = 1e-14;

/// Without the filter.
int exact_orientation(const NamedPoint& a, const NamedPoint& b, const NamedPoint& c, const NamedPoint& d) {
  Points p{a, b, c, d};
  int parity = 1;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 3; j > i; --j) {
      if (p[j - 1].id <= p[j].id) continue;
      std::swap(p[j - 1], p[j]);
      parity = -parity;
    }
  }
  // det [b-a, c-a, d-a] = -det [x y z 1] of the rows a, b, c, d.
  return -parity * moved_sign(p);
}

}  // namespace

int orientation(const NamedPoint& a, const NamedPoint& b, const NamedPoint& c, const NamedPoint& d) {
  const Vec3d o = vec_cast<double>(a.x_m);
  const Vec3d u = vec_cast<double>(b.x_m) - o, v = vec_cast<double>(c.x_m) - o,
              w = vec_cast<double>(d.x_m) - o;
  const double det = dot(u, cross(v, w));
  if (std::abs(det) > kUncertain * size(u) * size(v) * size(w)) return det > 0 ? 1 : -1;
  return exact_orientation(a, b, c, d);
}

NamedTriangle::NamedTriangle(const NamedPoint& c, const NamedPoint& d, const NamedPoint& e)
    : c_(c), d_(d), e_(e), origin_(vec_cast<double>(c.x_m)) {
  const Vec3d u = vec_cast<double>(d.x_m) - origin_, v = vec_cast<double>(e.x_m) - origin_;
  normal_ = cross(u, v);
  uncertain_ = kUncertain * size(u) * size(v);
  box_m_ = {min(c.x_m, min(d.x_m, e.x_m)), max(c.x_m, max(d.x_m, e.x_m))};
}

NamedTriangle::End NamedTriangle::end(const NamedPoint& a) const {
  // det [c-a, d-a, e-a] = -det [a-c, d-c, e-c].
  const Vec3d w = vec_cast<double>(a.x_m) - origin_;
  const double above = dot(normal_, w);
  if (std::abs(above) > uncertain_ * size(w)) return {above, above > 0 ? -1 : 1};
  return {above, exact_orientation(a, c_, d_, e_)};
}

/// Whether the line through a and b has all edges on one side: the three orientations of both with an edge.
bool NamedTriangle::is_met(const NamedPoint& a, const NamedPoint& b) const {
  const Vec3d o = vec_cast<double>(a.x_m), u = vec_cast<double>(b.x_m) - o;
  const Vec3d c = vec_cast<double>(c_.x_m) - o, d = vec_cast<double>(d_.x_m) - o,
              e = vec_cast<double>(e_.x_m) - o;
  const double cd = dot(u, cross(c, d)), de = dot(u, cross(d, e)), ec = dot(u, cross(e, c));
  const double size_c = size(c), size_d = size(d), size_e = size(e), of_u = kUncertain * size(u);
  if (std::abs(cd) > of_u * size_c * size_d && std::abs(de) > of_u * size_d * size_e &&
      std::abs(ec) > of_u * size_e * size_c)
    return (cd > 0) == (de > 0) && (cd > 0) == (ec > 0);
  const int s = orientation(a, b, c_, d_);
  return orientation(a, b, d_, e_) == s && orientation(a, b, e_, c_) == s;
}

double NamedTriangle::crossing(const NamedPoint& a, const End& of_a, const NamedPoint& b,
                               const End& of_b) const {
  if (of_a.side == of_b.side || !is_met(a, b)) return -1;
  return of_a.above == of_b.above ? 0.5 : std::clamp(of_a.above / (of_a.above - of_b.above), 0.0, 1.0);
}

namespace {

/// Shares of a point near the plane of abc, of b and of c.
std::array<double, 2> shares(Vec3d p, Vec3f a, Vec3f b, Vec3f c) {
  const Vec3d o = vec_cast<double>(a), u = vec_cast<double>(b) - o, v = vec_cast<double>(c) - o, w = p - o;
  const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), wu = dot(w, u), wv = dot(w, v);
  const double det = uu * vv - uv * uv;
  if (!(det > 1e-12 * uu * vv)) return {uu > vv ? wu / uu : 0.0, uu > vv || !(vv > 0) ? 0.0 : wv / vv};
  return {(wu * vv - wv * uv) / det, (wv * uu - wu * uv) / det};
}

}  // namespace

double swept_crossing(const std::array<NamedPoint, 2>& before, const std::array<NamedPoint, 2>& after,
                      const NamedPoint& c, const NamedPoint& d) {
  const auto where = [&](const NamedPoint& p, const NamedPoint& q, const NamedPoint& r,
                         std::array<double, 2>& of) {
    const NamedTriangle triangle(p, q, r);
    const double t = triangle.crossing(c, triangle.end(c), d, triangle.end(d));
    if (t < 0) return false;
    const Vec3d from = vec_cast<double>(c.x_m), to = vec_cast<double>(d.x_m);
    of = shares(from + t * (to - from), p.x_m, q.x_m, r.x_m);
    return true;
  };
  std::array<double, 2> of{};
  if (before[1].id != after[1].id && where(before[0], before[1], after[1], of))
    return std::clamp(of[0] + of[1], 0.0, 1.0);
  if (before[0].id != after[0].id && where(before[0], after[1], after[0], of))
    return std::clamp(of[0], 0.0, 1.0);
  return -1;
}

}  // namespace tactus::cut
