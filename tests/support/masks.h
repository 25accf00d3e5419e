#pragma once
/// Masks made by hand.
#include <cmath>

#include "tactus/geom/image.h"

namespace tactus::test {

/// Set where value(x, y) is true.
template <class F>
BitMask make_mask(Index width, Index height, F&& value) {
  BitMask mask(width, height);
  for (Index y = 0; y < height; ++y) {
    for (Index x = 0; x < width; ++x) {
      if (value(x, y)) mask.set(x, y);
    }
  }
  return mask;
}

/// Clears a disc of this diameter about the middle of the mask's pixels, moved by (dx, dy) pixels.
inline void punch(BitMask& mask, double diameter_px, double dx = 0, double dy = 0) {
  double x_sum = 0, y_sum = 0, n = 0;
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) {
      if (!mask(x, y)) continue;
      x_sum += x;
      y_sum += y;
      ++n;
    }
  }
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) {
      if (std::hypot(x - x_sum / n - dx, y - y_sum / n - dy) <= diameter_px / 2) mask.clear(x, y);
    }
  }
}

}  // namespace tactus::test
