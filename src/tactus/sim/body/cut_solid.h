#pragma once
/// The solid of a cut body that others, and its own walls, can touch.
#include <array>
#include <span>
#include <unordered_map>
#include <vector>

#include "tactus/contact/pairs/rest_solid.h"
#include "tactus/contact/pairs/solid_change.h"
#include "tactus/tissue/cut/body_cutter.h"

namespace tactus {

/// Owns the signed distances to the surface at rest, of the cubes next to it, as the body is cut. A part of a
/// cube has max(those of its parent, the distance to the wall, positive beyond it); so the material of other
/// parts there is outside. Then all that is near a new wall has max(its own, minus the distance to the wall),
/// up to kWallBand.
class CutSolid {
 public:
  /// How deep points may get below a wall, in spacings.
  static constexpr float kWallBand = 1.5F;

  CutSolid(const CubeLattice& lattice, const RestSolid& solid);

  /// After BodyCutter::cut. @param points of the body that touch, as CutPoints::update gave them
  SolidChange update(const cut::BodyCutter& cutter, const TopologyChange& change,
                     std::span<const PointChange> points);

 private:
  using Samples = std::array<float, CubeSamples::kCount>;
  struct WallPatch {
    std::vector<std::array<Vec3f, 3>> triangles;  ///< in lattice coordinates
  };
  const Samples& samples_of(Index cube) const;
  void part_samples(const cut::BodyCutter& cutter, const cut::CutSurface::NewSplit& split);
  static std::vector<WallPatch> new_walls(const cut::BodyCutter& cutter);
  std::vector<Vec3i> spread(const std::vector<WallPatch>& walls);
  std::vector<Index> press(const cut::LatticeCutter& cutter, const std::vector<Vec3i>& nearer);
  Index node_at(Vec3i p) const;

  float spacing_m_;
  Vec3i dims_;  ///< of nodes
  std::unordered_map<Index, Samples> samples_;
  std::vector<float> to_wall_;  ///< per place of a node, in spacings; kWallBand: that or more
  Samples deep_{};              ///< of cubes that are far from all surface
};

}  // namespace tactus
