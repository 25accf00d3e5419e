#pragma once
/// Triangulates a triangle with points on its edges, points inside and segments that must be edges.
#include <array>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus::cut {

struct DividedTriangle {
  std::vector<Vec2d> points;                ///< the first three are its corners, counter-clockwise
  std::array<std::vector<int>, 3> on_edge;  ///< points between corner k and the next one, in this order
  std::vector<std::array<int, 2>>
      segments;  ///< between these points and others inside; they meet at points only
};

/// Triangles of the same orientation. Chains of segments divide the outline into polygons, then ears are
/// clipped, the best first. So rounding changes the shape of triangles, but never on which side of a segment
/// they lie.
std::vector<std::array<int, 3>> triangulate(const DividedTriangle& divided);

}  // namespace tactus::cut
