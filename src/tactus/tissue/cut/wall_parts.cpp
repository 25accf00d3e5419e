#include "tactus/tissue/cut/wall_parts.h"

#include <algorithm>
#include <cmath>

namespace tactus::cut {

std::vector<WallPart> parts_of(const std::array<Vec3d, 3>& triangle) {
  const Vec3d a = triangle[0], ab = triangle[1] - a, ac = triangle[2] - a;
  const double longest = std::max({length(ab), length(ac), length(ac - ab)});
  const int k = std::max(1, static_cast<int>(std::ceil(8 * longest)));
  const Vec3d across = cross(ab, ac), normal = normalized(across, Vec3d{});
  const double area = 0.5 * length(across) / (k * k);
  std::vector<WallPart> parts;
  for (int i = 0; i < k; ++i)
    for (int j = 0; i + j < k; ++j) {
      const auto at_share = [&](double u, double v) { return a + (u / k) * ab + (v / k) * ac; };
      parts.push_back({at_share(i + 1.0 / 3, j + 1.0 / 3), area, normal});
      if (i + j + 1 < k) parts.push_back({at_share(i + 2.0 / 3, j + 2.0 / 3), area, normal});
    }
  return parts;
}

WallPart middle_part(const std::vector<WallPart>& parts) {
  Vec3d sum{}, normal{};
  double area = 0;
  for (const WallPart& part : parts) {
    sum += part.area * part.middle;
    normal += part.area * part.normal;
    area += part.area;
  }
  const Vec3d middle = area > 0 ? sum / area : parts.front().middle;
  const auto nearest =
      std::min_element(parts.begin(), parts.end(), [&](const WallPart& a, const WallPart& b) {
        return dot(a.middle - middle, a.middle - middle) < dot(b.middle - middle, b.middle - middle);
      });
  return {nearest->middle, area, normalized(normal, Vec3d{0, 1, 0})};
}

}  // namespace tactus::cut
