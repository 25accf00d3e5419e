#pragma once
/// Masks of a black object on white.
#include <cstdint>

#include "tactus/base/hd.h"

namespace tactus {

/// Whether a mask is the other way round: at least 95 % of its rim and half of its pixels are set. An object
/// seldom covers all of the rim of a picture; what is round a black one does.
/// @param set how many pixels are @param is_set whether pixel (x, y) is
template <class IsSet>
bool looks_inverted(Index width_px, Index height_px, std::int64_t set, IsSet&& is_set) {
  std::int64_t on_rim = 0;
  const auto look = [&](Index x, Index y) { on_rim += is_set(x, y) ? 1 : 0; };
  for (Index x = 0; x < width_px; ++x) look(x, 0), look(x, height_px - 1);
  for (Index y = 0; y < height_px; ++y) look(0, y), look(width_px - 1, y);
  const std::int64_t rim = 2 * (std::int64_t{width_px} + height_px), all = std::int64_t{width_px} * height_px;
  return 20 * on_rim >= 19 * rim && 2 * set > all;
}

}  // namespace tactus
