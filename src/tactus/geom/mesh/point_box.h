#pragma once
/// The box around points, in double precision.
#include <algorithm>
#include <cmath>

#include "tactus/base/vec.h"

namespace tactus {

struct PointBox {
  Vec3d min{HUGE_VAL, HUGE_VAL, HUGE_VAL}, max{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  void add(Vec3d p) {
    for (int k = 0; k < 3; ++k) {
      min[k] = std::min(min[k], p[k]);
      max[k] = std::max(max[k], p[k]);
    }
  }
  Vec3d extent() const { return max - min; }
  /// The longest edge.
  double size() const { return std::max({extent().x, extent().y, extent().z}); }
  Vec3d center() const { return min + 0.5 * extent(); }
};

}  // namespace tactus
