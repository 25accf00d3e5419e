#pragma once
/// How well the corners of a board cover a camera's image, and where to show the board next.
#include <span>
#include <string>
#include <vector>

#include "tactus/rig/calibrate/board.h"

namespace tactus {

constexpr Index kCoverageColumns = 6, kCoverageRows = 4;

struct Coverage {
  std::vector<Index> corners;  ///< by cell, rows of the image
  Index empty_cells = 0;
  /// "the lower left and the left edge are empty"; "" when all cells have corners.
  std::string advice;
};
Coverage coverage_of(std::span<const BoardView> views, Index camera, Vec2i size_px);

}  // namespace tactus
