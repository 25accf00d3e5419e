#pragma once
/// Where a blade and a body were when the blade cut last, as the body sees it.
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/tissue/topology_change.h"

namespace tactus::cut {

/// From the world to a body's rest state, in lattice coordinates: the rigid motion that takes nodes nearest
/// to where they were before; at first to where they rest.
struct RestFrame {
  Quatf turn{};  ///< from rest to the world
  Vec3d middle_m{}, middle{};
  float spacing_m = 1;

  /// Fits the frame to the nodes in a box, to all where it holds few. @param counts per node, whether it does
  /// @param guess of the turn
  static RestFrame fit(std::span<const Vec3f> before, std::span<const Vec3f> x_m, float spacing_m,
                       const std::function<bool(std::size_t)>& counts, const Box3f& box_m,
                       const Quatf& guess);
  /// Snapped to whole multiples of 2^-14 spacings: points that did not move stay where they are, to the bit.
  void to_rest(std::span<const Vec3f> points_m, std::span<Vec3f> rest) const;
};

/// A blade's edge and the body's nodes at the end of a strip are those at the begin of the next one, to the
/// bit. So no edge of the lattice slips past the blade between two strips, and none is asked twice: a node is
/// on one side of the blade from when it passes on.
struct BladeTrail {
  int frame = -1;                        ///< of the last strip; -1: there was none
  int steps = 0;                         ///< how often points moved
  std::vector<int> parts = {};           ///< of each segment of the edge
  std::vector<Vec3f> edge = {};          ///< points along it, in lattice coordinates
  std::vector<Vec3f> nodes = {};         ///< of the body, the same
  std::vector<std::uint8_t> names = {};  ///< per node: changes when it moves
  Quatf turn{};

  /// A blade's edge in points, two per spacing, as many in every strip.
  void begin(std::span<const Vec3f> edge_m, float spacing_m);
  std::vector<Vec3f> points_of(std::span<const Vec3f> edge_m) const;
  /// New nodes begin where those are that they were split from.
  void follow(const TopologyChange& change);
};

}  // namespace tactus::cut
