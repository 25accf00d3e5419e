#include "tactus/rig/calibrate/coverage.h"

#include <algorithm>

namespace tactus {
namespace {

/// Names of the nine parts of an image.
const char* part_name(Index part) {
  static const char* const kNames[] = {"upper left", "top",        "upper right", "left edge",  "middle",
                                       "right edge", "lower left", "bottom",      "lower right"};
  return kNames[part];
}

}  // namespace

Coverage coverage_of(std::span<const BoardView> views, Index camera, Vec2i size_px) {
  Coverage c;
  c.corners.resize(static_cast<std::size_t>(kCoverageColumns) * static_cast<std::size_t>(kCoverageRows));
  for (const BoardView& view : views) {
    if (view.camera != camera) continue;
    for (const BoardCorner& corner : view.corners) {
      const Index x =
          std::clamp(static_cast<Index>(corner.px.x / size_px.x * kCoverageColumns), 0, kCoverageColumns - 1);
      const Index y =
          std::clamp(static_cast<Index>(corner.px.y / size_px.y * kCoverageRows), 0, kCoverageRows - 1);
      ++c.corners[static_cast<std::size_t>(y * kCoverageColumns + x)];
    }
  }
  Index empty_of_part[9] = {};
  for (Index y = 0; y < kCoverageRows; ++y) {
    for (Index x = 0; x < kCoverageColumns; ++x) {
      if (c.corners[static_cast<std::size_t>(y * kCoverageColumns + x)] > 0) continue;
      ++c.empty_cells;
      ++empty_of_part[y * 3 / kCoverageRows * 3 + x * 3 / kCoverageColumns];
    }
  }
  std::string parts;
  for (Index part = 0; part < 9; ++part) {
    if (empty_of_part[part] > 0) parts += (parts.empty() ? "" : ", ") + std::string(part_name(part));
  }
  if (!parts.empty())
    c.advice = std::to_string(c.empty_cells) +
               " of 24 cells of the image saw no corner; show the board there next: " + parts;
  return c;
}

}  // namespace tactus
