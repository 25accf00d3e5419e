#pragma once
/// What a plane does to a closed mesh, from the mesh alone.
#include <array>
#include <cmath>
#include <vector>

#include "piece_count.h"
#include "tactus/geom/mesh/mesh.h"

namespace tactus::test {

/// What a plane does to a closed mesh: volumes below and above, and the area of the section. Both are
/// integrals over the surface about a point of the plane, where the section itself adds nothing.
struct Section {
  double below_m3 = 0, above_m3 = 0, area_m2 = 0;
};
inline Section section_of(const TriangleMesh& mesh, const CutPlane& plane) {
  Section s;
  for (const auto& t : mesh.triangles) {
    std::array<Vec3d, 3> p;
    std::array<double, 3> d;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = vec_cast<double>(mesh.positions_m[static_cast<std::size_t>(t[k])]) - plane.point;
      d[k] = dot(p[k], plane.normal);
    }
    std::vector<Vec3d> low, high, on;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t n = (k + 1) % 3;
      (d[k] < 0 ? low : high).push_back(p[k]);
      if ((d[k] < 0) == (d[n] < 0)) continue;
      const Vec3d cut = p[k] + d[k] / (d[k] - d[n]) * (p[n] - p[k]);
      low.push_back(cut), high.push_back(cut);
      d[k] < 0 ? on.push_back(cut) : (void)on.insert(on.begin(), cut);
    }
    const auto volume = [](const std::vector<Vec3d>& of) {
      double v = 0;
      for (std::size_t i = 2; i < of.size(); ++i) v += dot(of[0], cross(of[i - 1], of[i])) / 6;
      return v;
    };
    s.below_m3 += volume(low);
    s.above_m3 += volume(high);
    if (on.size() == 2) s.area_m2 += 0.5 * dot(plane.normal, cross(on[0], on[1]));
  }
  s.area_m2 = std::abs(s.area_m2);
  return s;
}

}  // namespace tactus::test
