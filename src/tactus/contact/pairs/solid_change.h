#pragma once
/// Changes of a cut to the cubes and points with which bodies touch.
#include <array>
#include <vector>

#include "tactus/geom/lattice/boundary_points.h"

namespace tactus {

/// Cubes and nodes are a body's, points as its contact points count them. See rest_solid.h for samples.
struct SolidChange {
  /// A cube or copy next to a surface that is new, has other nodes, or has other distances.
  struct Cube {
    Index cube = 0;
    Vec3i cell;
    std::array<Index, 8> nodes{};
  };
  std::vector<Cube> cubes;
  std::vector<float> sample_m;  ///< CubeSamples::kCount of each of those
  std::vector<Index> gone;      ///< cubes that are no more
  std::vector<PointChange> points;
  std::vector<Index> part;  ///< per node, of those that hang together; empty: as before
};

}  // namespace tactus
