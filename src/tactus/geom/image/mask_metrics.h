#pragma once
/// How well two silhouettes agree.
#include <string>

#include "tactus/base/error.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// Number of pixels set in both. @throws Error when the sizes differ.
inline std::int64_t common_area_px(const BitMask& a, const BitMask& b) {
  if (a.width_px != b.width_px || a.height_px != b.height_px) {
    throw Error("masks of " + std::to_string(a.width_px) + "x" + std::to_string(a.height_px) + " and " +
                std::to_string(b.width_px) + "x" + std::to_string(b.height_px) +
                " px can't be compared, expected equal sizes");
  }
  std::int64_t n = 0;
  for (std::size_t i = 0; i < a.words.size(); ++i) n += __builtin_popcount(a.words[i] & b.words[i]);
  return n;
}

/// Intersection over union, 0 to 1; 1 for two empty masks.
inline double iou(const BitMask& a, const BitMask& b) {
  const std::int64_t common = common_area_px(a, b);
  const std::int64_t either = a.area_px() + b.area_px() - common;
  return either == 0 ? 1 : static_cast<double>(common) / static_cast<double>(either);
}

/// Share of the pixels of `mask` that `rendered` covers, 0 to 1; 1 for an empty mask.
inline double recall(const BitMask& rendered, const BitMask& mask) {
  const std::int64_t common = common_area_px(rendered, mask);
  const std::int64_t area = mask.area_px();
  return area == 0 ? 1 : static_cast<double>(common) / static_cast<double>(area);
}

/// Mean place of the mask's pixels [px]; {0, 0} of an empty mask.
inline Vec2d center_px(const BitMask& mask) {
  double x_sum = 0, y_sum = 0, n = 0;
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) {
      if (!mask(x, y)) continue;
      x_sum += x;
      y_sum += y;
      n += 1;
    }
  }
  return n > 0 ? Vec2d{x_sum / n, y_sum / n} : Vec2d{};
}

}  // namespace tactus
