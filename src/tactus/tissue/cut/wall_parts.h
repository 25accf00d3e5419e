#pragma once
/// Triangles of walls in small parts.
#include <array>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus::cut {

/// A part of a wall, in lattice coordinates.
struct WallPart {
  Vec3d middle;
  double area = 0;
};

/// Parts whose edges are an eighth of a spacing at most.
std::vector<WallPart> parts_of(const std::array<Vec3d, 3>& triangle);
/// The one that is nearest to the middle of all. @param area of all
const WallPart& middle_part(const std::vector<WallPart>& parts, double& area);

}  // namespace tactus::cut
