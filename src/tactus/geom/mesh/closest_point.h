#pragma once
/// The point of a triangle that is nearest to a point (Ericson 2005, 5.1.5), on host and device.
#include "tactus/base/vec.h"

namespace tactus {

TACTUS_HD_CALLED inline Vec3f closest_point_on_triangle(Vec3f p, Vec3f a, Vec3f b, Vec3f c) {
  const Vec3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3f bp = p - b;
  const float d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return d1 - d3 > 0 ? a + (d1 / (d1 - d3)) * ab : a;
  const Vec3f cp = p - c;
  const float d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return d2 - d6 > 0 ? a + (d2 / (d2 - d6)) * ac : a;
  const float va = d3 * d6 - d5 * d4;
  const float e4 = d4 - d3, e5 = d5 - d6;
  if (va <= 0 && e4 >= 0 && e5 >= 0) return e4 + e5 > 0 ? b + (e4 / (e4 + e5)) * (c - b) : b;
  const float sum = va + vb + vc;
  if (sum > 0) return a + (vb / sum) * ab + (vc / sum) * ac;
  // A needle: its nearest corner is within its width of the nearest point.
  const float to_a = dot(ap, ap), to_b = dot(bp, bp), to_c = dot(cp, cp);
  if (to_a <= to_b && to_a <= to_c) return a;
  return to_b <= to_c ? b : c;
}

}  // namespace tactus
