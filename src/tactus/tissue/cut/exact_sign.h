#pragma once
/// Signs of determinants of points, without rounding and without ties.
#include <array>
#include <cstdint>

#include "tactus/base/vec.h"

namespace tactus::cut {

/// A point with a name. Names decide where positions leave a tie.
struct NamedPoint {
  Vec3f x_m;
  std::int64_t id = 0;
};

/// On which side of the plane through b, c and d the point a lies: the sign of det [b - a, c - a, d - a],
/// 1 or -1, never 0. It is exact: a filter in double, then sums without rounding. A determinant that is 0 is
/// decided as if every coordinate were moved by a symbolic amount that depends on its point's id alone
/// (Edelsbrunner & Muecke 1990). So all signs are those of one set of points in general position.
/// The four ids must differ.
int orientation(const NamedPoint& a, const NamedPoint& b, const NamedPoint& c, const NamedPoint& d);

/// A triangle that many segments are tested against: it keeps the values of its plane that all tests need.
class NamedTriangle {
 public:
  NamedTriangle(const NamedPoint& c, const NamedPoint& d, const NamedPoint& e);
  struct End {
    double above = 0;  ///< distance from the plane, times twice the area
    int side = 0;      ///< orientation(a, c, d, e)
  };
  End end(const NamedPoint& a) const;
  /// Where the segment ab crosses the triangle: the share of the way from a to b, 0..1; -1: it does not.
  /// A segment that goes through an edge crosses exactly one of the triangles that share the edge.
  double crossing(const NamedPoint& a, const End& of_a, const NamedPoint& b, const End& of_b) const;
  const Box3f& box_m() const { return box_m_; }

 private:
  bool is_met(const NamedPoint& a, const NamedPoint& b) const;
  NamedPoint c_, d_, e_;
  Vec3d origin_, normal_;
  double uncertain_;  ///< per distance: the part of a determinant that may be rounding
  Box3f box_m_;
};

/// Where a segment that moves goes through one that stays: the share of the way along it; -1: it does not. It
/// sweeps the triangles of its begin and the second end, and of the first end's way and that.
/// @param before,after ends, the first with the lower ids; an end that keeps its name does not move
double swept_crossing(const std::array<NamedPoint, 2>& before, const std::array<NamedPoint, 2>& after,
                      const NamedPoint& c, const NamedPoint& d);

}  // namespace tactus::cut
