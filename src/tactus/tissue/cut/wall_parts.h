#pragma once
/// Triangles of walls in small parts.
#include <array>
#include <vector>

#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {

/// A part of a wall, in lattice coordinates.
struct WallPart {
  Vec3d middle;
  double area = 0;
  Vec3d normal{};  ///< unit, to side 1
};

/// The newest walls in one cell, the cells_per_spacing-th of a cube's edge.
struct WallCell {
  std::array<Index, 2> cubes_of_sides;  ///< into which the cube fell apart
  WallPart wall;  ///< the middle of the part that is nearest to the middle of all; area and normal of all
};
/// By cube and place, ascending. @param cells_per_spacing >= 1
std::vector<WallCell> wall_cells(const CutSurface& surface, int cells_per_spacing);

}  // namespace tactus::cut
