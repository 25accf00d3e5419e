#pragma once
/// Triangles of a cell from the signs of its corners (Lorensen & Cline 1987), with a table that is derived,
/// not typed in: faces are cut by one rule that depends on the face's own signs only, so neighbours agree and
/// the surface is closed, and no triangle edge inside a cell joins two vertices of one cell face, so every
/// edge is used exactly twice.
#include <vector>

#include "tactus/base/hd.h"

namespace tactus {

/// Corner c of a cell: bit 0 is x, bit 1 is y, bit 2 is z.
/// Edge e of a cell: axis e/4; bits 0 and 1 of e%4 are its place along the other two axes, in the order x, y,
/// z.
inline constexpr int kCellEdges = 12;
inline constexpr int kMaxCellTriangles = 5;

/// Lower corner of an edge, as a corner number.
TACTUS_HD constexpr int edge_corner(int edge) {
  const int axis = edge >> 2, low = edge & 1, high = (edge >> 1) & 1;
  if (axis == 0) return low << 1 | high << 2;
  if (axis == 1) return low | high << 2;
  return low | high << 1;
}

/// The triangles of one of the 256 sign patterns (bit c set: corner c is inside), counter-clockwise from
/// outside.
struct CellCase {
  std::uint8_t triangle_count = 0;
  std::uint8_t edge[3 * kMaxCellTriangles] = {};
};

/// The 256 cases.
std::vector<CellCase> make_marching_cubes_table();

}  // namespace tactus
