#pragma once
/// Where in its image a silhouette lies.
#include <bit>

#include "tactus/geom/image/image.h"

namespace tactus {

/// Pixels min to max, both included; empty: max < min.
struct PixelRect {
  Index min_x = 0, min_y = 0, max_x = -1, max_y = -1;
  bool empty() const { return max_x < min_x; }
};

/// The smallest rectangle with all set pixels.
inline PixelRect bounds_of(const BitMask& mask) {
  PixelRect rect{mask.width_px, mask.height_px, -1, -1};
  const Index words = mask.words_per_row();
  for (Index y = 0; y < mask.height_px; ++y) {
    const std::uint32_t* row = mask.words.data() + static_cast<std::ptrdiff_t>(y) * words;
    Index first = 0, last = words - 1;
    while (first < words && row[first] == 0) ++first;
    if (first == words) continue;
    while (row[last] == 0) --last;
    rect.min_x = min(rect.min_x, 32 * first + std::countr_zero(row[first]));
    rect.max_x = max(rect.max_x, 32 * last + 31 - std::countl_zero(row[last]));
    rect.min_y = min(rect.min_y, y);
    rect.max_y = y;
  }
  return rect.max_y < 0 ? PixelRect{} : rect;
}

}  // namespace tactus
