#pragma once
/// Masks made by hand.
#include <cmath>

#include "tactus/geom/image/mask_metrics.h"

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
  const Vec2d center = center_px(mask);
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) {
      if (std::hypot(x - center.x - dx, y - center.y - dy) <= diameter_px / 2) mask.clear(x, y);
    }
  }
}

}  // namespace tactus::test
