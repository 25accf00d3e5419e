#pragma once
/// Triangulates a triangle with points on its edges, points inside and segments that must be edges.
#include <array>

#include "tactus/base/vec.h"
#include "tactus/tissue/cut/short_list.h"

namespace tactus::cut {

struct DividedTriangle {
  ShortList<Vec2d, 16> points;               ///< the first three are its corners, counter-clockwise
  std::array<ShortList<int, 6>, 3> on_edge;  ///< points between corner k and the next one, in this order
  ShortList<std::array<int, 2>, 8>
      segments;  ///< between these points and others inside; they meet at points only
};

/// Adds triangles of the same orientation. Chains of segments divide the outline into polygons, then ears are
/// clipped, the best first. So rounding changes the shape of triangles, but never on which side of a segment
/// they lie.
void triangulate(const DividedTriangle& divided, ShortList<std::array<int, 3>, 16>& found);

}  // namespace tactus::cut
