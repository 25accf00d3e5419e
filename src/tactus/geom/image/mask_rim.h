#pragma once
/// Masks of a black object on white.
#include <cstdint>

#include "tactus/base/hd.h"

namespace tactus {

/// The share of a mask's rim that is set. An object seldom covers all of the rim of a picture; white round a
/// black one does.
/// @param is_set whether pixel (x, y) is
template <class IsSet>
double share_of_rim(Index width_px, Index height_px, IsSet&& is_set) {
  std::int64_t on_rim = 0;
  const auto look = [&](Index x, Index y) { on_rim += is_set(x, y) ? 1 : 0; };
  for (Index x = 0; x < width_px; ++x) look(x, 0), look(x, height_px - 1);
  for (Index y = 0; y < height_px; ++y) look(0, y), look(width_px - 1, y);
  return static_cast<double>(on_rim) / (2 * (static_cast<double>(width_px) + height_px));
}

}  // namespace tactus
