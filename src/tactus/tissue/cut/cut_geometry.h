#pragma once
/// Geometry of points for the surface of a body that is cut.
#include <cmath>

#include "tactus/base/vec.h"

namespace tactus::cut {

/// To 2^-40 spacings: steps of this size add up without rounding, so points stay in the planes of cubes and
/// of their tetrahedra.
inline double rounded(double v) { return std::nearbyint(v * 0x1p40) * 0x1p-40; }
inline Vec3d rounded(Vec3d v) { return {rounded(v.x), rounded(v.y), rounded(v.z)}; }
inline Vec3d between(Vec3d a, Vec3d b, double t) { return a + rounded(t * (b - a)); }

inline double volume6(Vec3d a, Vec3d b, Vec3d c, Vec3d d) { return dot(b - a, cross(c - a, d - a)); }

/// Whether the line through a and b goes through cde.
inline bool turns_round(Vec3d a, Vec3d b, Vec3d c, Vec3d d, Vec3d e) {
  const bool s = volume6(a, b, c, d) > 0;
  return (volume6(a, b, d, e) > 0) == s && (volume6(a, b, e, c) > 0) == s;
}

inline bool apart(Vec3d low_a, Vec3d high_a, Vec3d low_b, Vec3d high_b) {
  return low_a.x > high_b.x || low_a.y > high_b.y || low_a.z > high_b.z || low_b.x > high_a.x ||
         low_b.y > high_a.y || low_b.z > high_a.z;
}

/// Calls f for the cubes of the lattice that a triangle may meet.
template <class F>
void for_each_cell(Vec3d a, Vec3d b, Vec3d c, F&& f) {
  const Vec3d margin{2e-5, 2e-5, 2e-5}, low = min(a, min(b, c)) - margin, high = max(a, max(b, c)) + margin;
  const auto cell = [](Vec3d p) {
    return Vec3i{static_cast<Index>(std::floor(p.x)), static_cast<Index>(std::floor(p.y)),
                 static_cast<Index>(std::floor(p.z))};
  };
  const Vec3i first = cell(low), last = cell(high);
  for (Index z = first.z; z <= last.z; ++z)
    for (Index y = first.y; y <= last.y; ++y)
      for (Index x = first.x; x <= last.x; ++x) f(Vec3i{x, y, z});
}

}  // namespace tactus::cut
