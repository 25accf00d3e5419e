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

/// Where the segment ab crosses the triangle cde: the share of the way from a to b, 0..1; -1: it does not.
/// Of triangles that share an edge exactly one is crossed by a segment that goes through it.
double crossing(const NamedPoint& a, const NamedPoint& b, const NamedPoint& c, const NamedPoint& d,
                const NamedPoint& e);

}  // namespace tactus::cut
