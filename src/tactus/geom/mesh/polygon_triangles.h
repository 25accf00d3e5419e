#pragma once
/// Plane polygons as triangles, on the host.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

/// Appends the n - 2 triangles of a polygon, as numbers of its corners, turning as it turns. A polygon whose
/// fan around corner 0 folds nowhere becomes that fan; others are clipped ear by ear (Meisters 1975). Corners
/// may repeat (a hole that is joined to the outline by a slit) and lie a little off a plane. A polygon that
/// crosses itself also becomes n - 2 triangles that its edges bound.
/// @param tests how many tests of a corner against an ear may be made; those made are subtracted
/// @return false when `tests` did not suffice: nothing was appended
bool triangulate_polygon(std::span<const Vec3d> corners, std::int64_t& tests,
                         std::vector<std::array<Index, 3>>& triangles);

}  // namespace tactus
