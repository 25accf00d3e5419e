#include "tactus/tissue/cut/cut_points.h"

#include <algorithm>

#include "tactus/base/at.h"
#include "tactus/tissue/cut/wall_parts.h"

namespace tactus::cut {
namespace {

/// The gradient of a cube's trilinear weights along the wall's normal. Where both sides of the cut share most
/// of the weights that move the point, at the end of a cut, the wall can't be parted: 0.
WallSide side_of(const LatticeCutter& cutter, Index cube, Vec3d local, const PointChange& change) {
  const CubeLattice& lattice = cutter.lattice();
  WallSide side;
  float own = 0;  // of the weights
  for (std::size_t k = 0; k < 8; ++k) {
    const Index node = change.to.node[k];
    const auto& nodes = lattice.cube_nodes[at(cube)];
    const auto q = static_cast<unsigned>(std::find(nodes.begin(), nodes.end(), node) - nodes.begin());
    const auto share = [&](int a) {
      return (q >> static_cast<unsigned>(a) & 1U) != 0 ? local[a] : 1 - local[a];
    };
    for (int a = 0; a < 3; ++a) {
      const double slope = (q >> static_cast<unsigned>(a) & 1U) != 0 ? 1 : -1;
      side.weight[k] += change.wall[a] * static_cast<float>(slope * share((a + 1) % 3) * share((a + 2) % 3));
    }
    bool is_shared = false;
    for (const Index other : cutter.live(cutter.regular_of(cube)))
      is_shared = is_shared || (other != cube && lattice.cube_nodes[at(other)].at(q) == node);
    own += is_shared ? 0.F : change.to.weight[k];
  }
  return own > 0.5F ? side : WallSide{};
}

}  // namespace

CutPoints::CutPoints(const CubeLattice& lattice, std::span<const SpreadPoint> points,
                     std::span<const embed::Anchor> anchors, std::span<const embed::Anchor> bearing,
                     Index first_new, Index capacity)
    : next_(first_new), end_(first_new + capacity) {
  for (std::size_t p = 0; p < points.size(); ++p) {
    const embed::Anchor& anchor = anchors[p];
    const auto place = static_cast<Index>(p);
    of_cube_[anchor.cube].push_back(points_.size());
    if (bearing[p].cube != anchor.cube) of_cube_[bearing[p].cube].push_back(points_.size());
    points_.push_back({place < first_new ? place : place + capacity,
                       vec_cast<double>(lattice.cubes[at(anchor.cube)]) + vec_cast<double>(anchor.local),
                       anchor.cube, points[p].area_m2});
  }
}

/// In each eighth of a cube, the wall's part that is nearest to the middle of all parts there is the point.
void CutPoints::add_walls(const LatticeCutter& cutter, const CutSurface& surface, double unit_m2) {
  for (const auto& [cubes_of_sides, wall] : wall_cells(surface, 2)) {
    if (!(wall.area > 1e-3)) continue;  // the next cell has a point there
    const Vec3f normal = vec_cast<float>(wall.normal);
    for (const std::size_t side : {0U, 1U}) {
      const Index cube = surface.leaf(cubes_of_sides.at(side), wall.middle);
      add(cutter,
          {next_, wall.middle, cube, static_cast<float>(wall.area * unit_m2), side == 0 ? normal : -normal});
    }
  }
}

void CutPoints::add(const LatticeCutter& cutter, const Point& point) {
  if (next_ >= end_) {
    is_full_ = true;
    return;
  }
  ++next_;
  of_cube_[cutter.regular_of(point.cube)].push_back(points_.size());
  points_.push_back(point);
}

std::vector<PointChange> CutPoints::update(const LatticeCutter& cutter, const CutSurface& surface,
                                           const TopologyChange& change) {
  const CubeLattice& lattice = cutter.lattice();
  add_walls(cutter, surface, sqr(double{lattice.spacing_m}));
  std::set<Index> cubes;
  for (const TopologyChange::Copy& copy : change.copies) cubes.insert(copy.copy.of);
  std::vector<std::size_t> moved;
  for (const Index cube : cubes)
    if (const auto known = of_cube_.find(cube); known != of_cube_.end())
      moved.insert(moved.end(), known->second.begin(), known->second.end());
  std::sort(moved.begin(), moved.end());
  moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
  std::vector<SpreadPoint> points;
  std::vector<Index> cube_of;
  std::vector<Vec3f> local_of;
  for (const std::size_t p : moved) {
    Point& point = points_[p];
    point.cube = surface.leaf(point.cube, point.p);
    points.push_back({{}, point.area_m2});
    cube_of.push_back(point.cube);
    local_of.push_back(vec_cast<float>(point.p - vec_cast<double>(lattice.cubes[at(point.cube)])));
  }
  const std::vector<EmbeddedPoint> embedded = embed_points(lattice, points, cube_of, local_of);
  std::vector<PointChange> changes;
  for (std::size_t k = 0; k < moved.size(); ++k) {
    const Point& point = points_[moved[k]];
    changes.push_back({point.place, embedded[k], point.cube, vec_cast<float>(point.p), point.wall, {}});
    if (dot(point.wall, point.wall) > 0)
      changes.back().side = side_of(cutter, point.cube, vec_cast<double>(local_of[k]), changes.back());
  }
  std::sort(changes.begin(), changes.end(),
            [](const PointChange& a, const PointChange& b) { return a.point < b.point; });
  return changes;
}

}  // namespace tactus::cut
