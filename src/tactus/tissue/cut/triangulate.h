#pragma once
/// Triangulates a triangle with points on its edges, points inside and segments that must be edges.
#include <array>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus::cut {

struct DividedTriangle {
  std::vector<Vec2d> points;                 ///< the first three are its corners, counter-clockwise
  std::array<std::vector<int>, 3> on_edge;   ///< points between corner k and the next one, in this order
  std::vector<int> inside;                   ///< all others
  std::vector<std::array<int, 2>> segments;  ///< they meet at points only
};

/// Triangles of the same orientation. Points go in one by one; edges that cross a segment are flipped (Sloan
/// 1993). A segment that rounding does not let in is left out: then triangles lie on both sides of it.
std::vector<std::array<int, 3>> triangulate(const DividedTriangle& divided);

}  // namespace tactus::cut
