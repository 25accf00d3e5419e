#include "tactus/tissue/cut/cut_points.h"

#include <map>

namespace tactus::cut {
namespace {

std::size_t at(std::int64_t i) { return static_cast<std::size_t>(i); }

/// A piece of a wall, in lattice coordinates.
struct Piece {
  Vec3d middle;
  double area;
  Vec3d normal;  ///< to side 1
};

/// Pieces whose edges are an eighth of a spacing at most.
std::vector<Piece> pieces_of(const std::array<Vec3d, 3>& triangle) {
  const Vec3d a = triangle[0], ab = triangle[1] - a, ac = triangle[2] - a;
  const double longest = std::max({length(ab), length(ac), length(ac - ab)});
  const int k = std::max(1, static_cast<int>(std::ceil(8 * longest)));
  const Vec3d normal = cross(ab, ac);
  const double area = 0.5 * length(normal) / (k * k);
  std::vector<Piece> pieces;
  for (int i = 0; i < k; ++i)
    for (int j = 0; i + j < k; ++j) {
      const auto at_share = [&](double u, double v) { return a + (u / k) * ab + (v / k) * ac; };
      pieces.push_back({at_share(i + 1.0 / 3, j + 1.0 / 3), area, normal});
      if (i + j + 1 < k) pieces.push_back({at_share(i + 2.0 / 3, j + 2.0 / 3), area, normal});
    }
  return pieces;
}

}  // namespace

CutPoints::CutPoints(const CubeLattice& lattice, std::span<const SpreadPoint> points,
                     std::span<const embed::Anchor> anchors, Index first_new, Index room)
    : next_(first_new), end_(first_new + room) {
  for (std::size_t p = 0; p < points.size(); ++p) {
    const embed::Anchor& anchor = anchors[p];
    const auto place = static_cast<Index>(p);
    of_cube_[anchor.cube].push_back(points_.size());
    points_.push_back({place < first_new ? place : place + room,
                       vec_cast<double>(lattice.cubes[at(anchor.cube)]) + vec_cast<double>(anchor.local),
                       anchor.cube, points[p].area_m2});
  }
}

/// Of the pieces in an eighth of a cube, the one nearest to their middle is the point.
void CutPoints::add_walls(const LatticeCutter& cutter, const CutSurface& surface, double unit_m2) {
  struct Cell {
    std::array<Index, 2> part;
    std::vector<Piece> pieces;
  };
  std::map<std::array<Index, 4>, Cell> cells;  // by cube that fell apart, and eighth
  for (const CutSurface::NewWall& wall : surface.new_walls()) {
    for (const Piece& piece : pieces_of(wall.corners)) {
      const auto half = [](double v) { return static_cast<Index>(std::floor(2 * v)); };
      Cell& cell = cells[{wall.part[0], half(piece.middle.x), half(piece.middle.y), half(piece.middle.z)}];
      cell.part = wall.part;
      cell.pieces.push_back(piece);
    }
  }
  for (const auto& [key, cell] : cells) {
    Vec3d sum{}, to_1{};
    double area = 0;
    for (const Piece& piece : cell.pieces) {
      sum += piece.area * piece.middle;
      to_1 += piece.area * normalized(piece.normal);
      area += piece.area;
    }
    if (!(area > 1e-3)) continue;  // the next cell has a point there
    const Vec3d middle = sum / area;
    const auto nearest =
        std::min_element(cell.pieces.begin(), cell.pieces.end(), [&](const Piece& a, const Piece& b) {
          return dot(a.middle - middle, a.middle - middle) < dot(b.middle - middle, b.middle - middle);
        });
    const Vec3f wall = vec_cast<float>(normalized(to_1));
    for (const std::size_t side : {0U, 1U}) {
      const Index cube = surface.leaf(cell.part[side], nearest->middle);
      add(cutter,
          {next_, nearest->middle, cube, static_cast<float>(area * unit_m2), side == 0 ? wall : -wall});
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
    changes.push_back({point.place, embedded[k], vec_cast<float>(point.p), point.wall});
  }
  std::sort(changes.begin(), changes.end(),
            [](const PointChange& a, const PointChange& b) { return a.point < b.point; });
  return changes;
}

}  // namespace tactus::cut
