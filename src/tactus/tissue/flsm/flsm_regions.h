#pragma once
/// The regions of fast lattice shape matching and all that never changes of them (Rivers & James 2007), on
/// the host.
#include <cstdint>
#include <vector>

#include "tactus/geom/lattice/cube_lattice.h"
#include "tactus/multi_device/device_set.h"

namespace tactus {

/// The padded box of cells that holds the lattice's nodes. Cell (i,j,k) of the lattice is at `index`; around
/// the nodes lie at least `pad` cells that are always zero, so windows need no bounds checks.
struct FlsmGrid {
  static constexpr Index kLanes = 16;  ///< cells along x that are worked on together
  static constexpr Index kChunk = 8;   ///< outputs along y or z of one sliding window
  Index pad = 0, stride_y = 0, stride_z = 0, cells = 0;
  Index index(Vec3i p) const { return (p.z + pad) * stride_z + (p.y + pad) * stride_y + p.x + pad; }
};

/// Where the nodes of a region are not all nodes in its box: the window sum over the box is corrected by the
/// shorter list, `minus` those in the box that are not in reach, or anew from those that are.
struct FlsmException {
  Index cell = 0, begin = 0, end = 0;
  Index anew = 0;  ///< 1: list holds the region's own nodes; 0: the nodes to subtract
};
/// Offset of a listed node from the region's centre node, in cells.
struct FlsmOffset {
  std::int8_t x = 0, y = 0, z = 0, unused = 0;
};

/// Region r: the nodes within w moves of node r, a move leading from a node to any node of a cube it belongs
/// to. Reach is symmetric: i is in region r exactly when r is in region i.
struct FlsmRegions {
  int half_width = 1;
  /// Spread that gives omega: omega^2 = E / (rho sigma^2). A region of spread s^2 (the largest variance of
  /// its nodes along any direction) resists strain with its weight times rho omega^2 s^2, so weights are
  /// proportional to 1 / s^2: regions that are cut off at an end are as stiff as whole ones.
  double sigma2_m2 = 0;
  FlsmGrid grid;

  // per node
  std::vector<Index> cell;             ///< dense cell of the node
  std::vector<Index> region_nodes;     ///< |R_i|
  std::vector<double> shared_mass_kg;  ///< m~_i = m_i / |R_i|; float would pull towards the world's origin
  std::vector<double> weight_sum;      ///< of the regions that hold the node
  std::vector<float> held;             ///< their mean weight, 1 at most: part of omega^2 that acts on it

  // per cell; 0 where there is no node
  std::vector<double> inverse_mass_per_kg;  ///< weight / M_r, M_r = sum of m~
  std::vector<float> turn_m;                ///< weight times spacing
  std::vector<double> center;  ///< [3 * cells] rest centre of r minus rest position of node r, in spacings

  std::vector<FlsmException> exceptions;
  std::vector<FlsmOffset> offsets;

  /// First cells of the blocks of work (kLanes along x), ascending. `nodes`: rows that hold nodes;
  /// `row_sums`: rows whose sums along x are needed; chunked in y (`y_*`) or z (`z_*`): in the order x, y, z
  /// to sum over regions, z, y, x to sum over goals. For half width 1 `node_rows` alone are worked on.
  std::vector<Index> node_rows, x_rows, y_blocks, z_blocks, goal_z_blocks, goal_y_blocks;
};

/// @throws Error for half widths outside 1..4 and bodies whose box of cells is too large (with the memory).
FlsmRegions make_flsm_regions(const CubeLattice& lattice, int half_width);

/// Layers of nodes that goals of own layers depend on: 2 w, and below as far as the sliding sums begin.
/// Own layers begin at multiples of FlsmGrid::kChunk, so that every sum is the whole body's, bit for bit.
Slab flsm_window(Slab own, int half_width, Index layers);
/// The part of a body's regions that the goals of own layers need, on a device that holds only the nodes of
/// the window.
FlsmRegions flsm_layers(const FlsmRegions& all, const CubeLattice& lattice, Slab own);

/// Offsets of all nodes of the region of `node`, by the definition (for tests and other references).
std::vector<FlsmOffset> flsm_region_of(const CubeLattice& lattice, int half_width, Index node);

}  // namespace tactus
