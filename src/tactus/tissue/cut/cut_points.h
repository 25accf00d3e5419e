#pragma once
/// Points on a body's surface, that touch, as the body is cut.
#include <unordered_map>

#include "tactus/geom/lattice/boundary_points.h"
#include "tactus/tissue/cut/cut_surface.h"

namespace tactus::cut {

/// Owns where the points rest. Points in cubes that are cut go with the copy that has their place. Walls get
/// points on both sides, half a spacing apart; they take the places behind the first ones. A small part that
/// less than four of them are on gets one at each corner of its surface: else nothing would hold it.
class CutPoints {
 public:
  CutPoints() = default;
  /// @param anchors in regular cubes @param bearing those that move the points before the first cut (the same
  /// ones, or neighbours) @param first_new place of the first new point @param capacity for them
  CutPoints(const CubeLattice& lattice, std::span<const SpreadPoint> points,
            std::span<const embed::Anchor> anchors, std::span<const embed::Anchor> bearing, Index first_new,
            Index capacity);

  /// After CutSurface::update. @returns ascending
  std::vector<PointChange> update(const LatticeCutter& cutter, const CutSurface& surface,
                                  const TopologyChange& change);
  /// More than there was capacity for was left out.
  bool is_full() const { return is_full_; }

 private:
  struct Point {
    Index place = 0;
    Vec3d p;         ///< at rest, in lattice coordinates
    Index cube = 0;  ///< or copy
    float area_m2 = 0;
    Vec3f wall{};  ///< as PointChange
  };
  void add_walls(const LatticeCutter& cutter, const CutSurface& surface, double area_of_unit_m2);
  void add_to_bare_parts(const LatticeCutter& cutter, const CutSurface& surface, const TopologyChange& change,
                         double area_of_unit_m2);
  int points_on(const LatticeCutter& cutter, Index copy) const;
  void add(const LatticeCutter& cutter, const Point& point);

  std::vector<Point> points_;
  /// Points in each regular cube, or moved by it.
  std::unordered_map<Index, std::vector<std::size_t>> of_cube_;
  Index next_ = 0, end_ = 0;
  bool is_full_ = false;
};

}  // namespace tactus::cut
