#pragma once
/// How a lattice is laid out in memory and cut into tiles for the element forces, on the host.
#include <vector>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/multi_device/device_set.h"
#include "tactus/tissue/tled/tled_data.h"

namespace tactus::tled {

struct TilePlan {
  Grid grid;
  std::vector<Tile> tiles;            ///< those with an element at one of their own nodes
  Index edge_tiles = 0;               ///< the first so many own nodes that other devices read; then ascending
  std::vector<std::uint32_t> active;  ///< per tile and layer of cubes: groups that hold a cube
  std::vector<Index> node_cell;       ///< per node
  std::vector<Index> cube_cell;       ///< per regular cube
  Index first_virtual_cell = 0;       ///< virtual nodes have the cells from here on
};

/// Limits of tiles.
struct TileLimits {
  Index groups = 0;       ///< at most
  Index groups_x = 0;     ///< at most, along x
  bool segments = false;  ///< rows are cut into Grid's segments, and groups_x fill one
  Index layers = 0;       ///< of nodes, at most
  Index processors =
      0;  ///< that share the tiles, as many layers each as they are done soonest with; 0: at most
};

/// @param in_use per cube: whether it is an element here; empty: all.
/// @param own layers of nodes whose forces are wanted; those around are other devices'
/// @throws Error when the lattice's box is too large to be indexed.
TilePlan plan_tiles(const CubeLattice& lattice, const std::vector<std::uint8_t>& in_use,
                    const TileLimits& limits, Slab own);

}  // namespace tactus::tled
