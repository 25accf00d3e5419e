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
  Vec3d normal{};  ///< unit, to side 1
};

/// Parts whose edges are an eighth of a spacing at most.
std::vector<WallPart> parts_of(const std::array<Vec3d, 3>& triangle);
/// Of one or more parts: the middle of that which is nearest to the middle of all, the area and the normal of
/// all.
WallPart middle_part(const std::vector<WallPart>& parts);

}  // namespace tactus::cut
