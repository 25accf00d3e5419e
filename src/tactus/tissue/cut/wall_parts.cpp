#include "tactus/tissue/cut/wall_parts.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace tactus::cut {

namespace {

/// Parts whose edges are an eighth of a spacing at most.
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

/// The middle of the part that is nearest to the middle of all, the area and the normal of all.
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

}  // namespace

std::vector<WallCell> wall_cells(const CutSurface& surface, int cells_per_spacing) {
  struct Cell {
    std::array<Index, 2> cubes_of_sides;
    std::vector<WallPart> parts;
  };
  const auto place = [&](double v) { return static_cast<Index>(std::floor(cells_per_spacing * v)); };
  std::map<std::array<Index, 4>, Cell> cells;  // by cube that fell apart, and place
  for (const CutSurface::NewWall& wall : surface.new_walls()) {
    for (const WallPart& part : parts_of(wall.corners)) {
      Cell& cell = cells[{wall.part[0], place(part.middle.x), place(part.middle.y), place(part.middle.z)}];
      cell.cubes_of_sides = wall.part;
      cell.parts.push_back(part);
    }
  }
  std::vector<WallCell> all;
  for (const auto& [key, cell] : cells) all.push_back({cell.cubes_of_sides, middle_part(cell.parts)});
  return all;
}

}  // namespace tactus::cut
