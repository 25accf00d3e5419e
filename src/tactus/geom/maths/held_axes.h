#pragma once
/// Along which axes of the world a node is held.
#include <cstdint>

#include "tactus/base/vec.h"

namespace tactus {

/// Bits: x 1, y 2, z 4. 0: the node is free.
using HeldAxes = std::uint8_t;
inline constexpr HeldAxes kAllAxes = 7;

/// A node's motion without its components along held axes.
TACTUS_HD inline Vec3f free_part(Vec3f v, Index held) {
  return {(held & 1) != 0 ? 0.F : v.x, (held & 2) != 0 ? 0.F : v.y, (held & 4) != 0 ? 0.F : v.z};
}

}  // namespace tactus
