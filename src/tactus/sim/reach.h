#pragma once
/// Where something rigid is that may touch bodies, and how fast.
#include "tactus/base/vec.h"

namespace tactus {

/// A component of the real surface, a tool or an obstacle that moves.
struct Reach {
  Vec3d low_m, high_m;  ///< its box, world
  double m_s = 0;       ///< speed of its fastest point
};

}  // namespace tactus
