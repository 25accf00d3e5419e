#include "tactus/tissue/cut/cut_points.h"

#include <algorithm>
#include <array>
#include <set>

#include "tactus/base/at.h"
#include "tactus/tissue/cut/small_part.h"
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

int CutPoints::points_on(const LatticeCutter& cutter, Index copy) const {
  const auto known = of_cube_.find(cutter.regular_of(copy));
  if (known == of_cube_.end()) return 0;
  return static_cast<int>(std::count_if(known->second.begin(), known->second.end(),
                                        [&](std::size_t p) { return points_[p].cube == copy; }));
}

/// Parts that this change may have made. Later cuts took the points of their walls away, and each wall that
/// is new is too small for one. A part that three points don't hold turns through what they lie on.
void CutPoints::add_to_bare_parts(const LatticeCutter& cutter, const CutSurface& surface,
                                  const TopologyChange& change, double unit_m2) {
  constexpr std::size_t kMostCopies = 16;  // a part of more has walls that got points
  constexpr int kEnough = 4;
  std::set<Index> bare;
  for (const TopologyChange::Copy& copy : change.copies) {
    if (bare.contains(copy.cube)) continue;
    int count = 0;
    for (const Index part : small_part(cutter, copy.cube, kMostCopies, [&](Index c) {
           count += points_on(cutter, c);
           return count < kEnough;
         }))
      bare.insert(part);
  }
  if (bare.empty()) return;
  std::set<Index> done;
  for (Index t = 0; t < static_cast<Index>(surface.triangles().size()); ++t) {
    const auto& corners = surface.triangles()[at(t)];
    if (corners[0] == corners[1] && corners[1] == corners[2]) continue;  // not in use
    std::array<Vec3d, 3> p;
    std::array<Index, 3> cube;
    for (std::size_t k = 0; k < 3; ++k) {
      const embed::Anchor anchor = surface.anchor(cutter, corners[k]);
      cube[k] = anchor.cube;
      p[k] = vec_cast<double>(cutter.lattice().cubes[at(anchor.cube)]) + vec_cast<double>(anchor.local);
    }
    const Vec3d normal = cross(p[1] - p[0], p[2] - p[0]);
    for (std::size_t k = 0; k < 3; ++k)
      if (bare.contains(cube[k]) && done.insert(corners[k]).second)
        add(cutter, {next_, p[k], cube[k], static_cast<float>(length(normal) / 6 * unit_m2),
                     surface.is_wall(t) ? vec_cast<float>(normalized(normal)) : Vec3f{}});
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
  const double unit_m2 = sqr(double{lattice.spacing_m});
  add_walls(cutter, surface, unit_m2);
  std::set<Index> cubes;
  for (const TopologyChange::Copy& copy : change.copies) cubes.insert(copy.copy.of);
  std::vector<std::size_t> moved;
  for (const Index cube : cubes)
    if (const auto known = of_cube_.find(cube); known != of_cube_.end())
      moved.insert(moved.end(), known->second.begin(), known->second.end());
  std::sort(moved.begin(), moved.end());
  moved.erase(std::unique(moved.begin(), moved.end()), moved.end());
  for (const std::size_t p : moved) points_[p].cube = surface.leaf(points_[p].cube, points_[p].p);
  const std::size_t first_bare = points_.size();
  add_to_bare_parts(cutter, surface, change, unit_m2);
  for (std::size_t p = first_bare; p < points_.size(); ++p) moved.push_back(p);
  std::vector<SpreadPoint> points;
  std::vector<Index> cube_of;
  std::vector<Vec3f> local_of;
  for (const std::size_t p : moved) {
    const Point& point = points_[p];
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
