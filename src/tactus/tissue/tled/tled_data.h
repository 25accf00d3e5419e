#pragma once
/// Values over which the kernels of elements work: cells, tiles, stiffnesses, copies, and the worst of some
/// cubes.
#include "tactus/frame/frame_params.h"

namespace tactus::tled {

/// Columns of cubes that are worked on side by side.
inline constexpr int kLanes = 8;

/// Most layers of nodes of a tile.
inline constexpr int kMostLayers = 16;

/// Stiffness of cubes of one kind.
struct alignas(16) Stiffness {
  float mu_Pa = 0, lambda_Pa = 0;
  float hourglass_N_m = 0;
};

/// Cells of a dense box round the lattice: a node and the cube above, behind and right of it share one. Rows
/// may be cut into segments that begin at whole lines of memory. From the second on their first cell is
/// empty: a tile's own nodes are the others, and its first column is the last of the segment before.
struct Grid {
  static constexpr Index kSegment = 32;
  Index stride_y = 0, stride_z = 0, cells = 0;
  Index first = 0;         ///< of node 0, 0, 0
  Index has_segments = 0;  ///< 1: then `first` is the first cell of one
  TACTUS_HD Index cell(Vec3i p) const {
    const Index gaps = has_segments != 0 ? (p.x - 1) / (kSegment - 1) : 0;
    return first + p.x + gaps + p.y * stride_y + p.z * stride_z;
  }
  TACTUS_HD Index right_of(Index cell) const {
    return cell + 1 + ((cell & (kSegment - 1)) == kSegment - 1 ? has_segments : 0);
  }
};

/// Columns of cubes that one block walks: `groups` of kLanes along x times `rows` along y, `layers` of nodes
/// up. Own nodes are those between columns: neighbouring tiles share a row and a column of cubes.
struct Tile {
  Index first = 0;  ///< cell below and before the first own node, or left of that, or the segment's empty one
  Index shares = 0;  ///< 1: the first column is also the last of the tile to the left; 0: there is none
  Index groups = 0, rows = 0, layers = 0;
  Index active = 0;  ///< into the masks: one per layer of cubes, bit per group that holds a cube
};

/// Stiffness per cell, as its kind: few bytes, which counts most on a GPU.
struct StiffnessKinds {
  View<const std::uint16_t> kind;  ///< 0: no cube
  View<const Stiffness> kinds;
  TACTUS_HD Stiffness operator[](Index cell) const { return kinds[kind[cell]]; }
};

/// A copy's corners.
struct CopyCells {
  Index cell[8];
};

/// Nodes that move on this device: some regular ones, and some of the virtual elements.
struct OwnNodes {
  Index begin = 0, end = 0, virtual_begin = 0, virtual_end = 0;
  TACTUS_HD bool has(Index node) const {
    return (node >= begin && node < end) || (node >= virtual_begin && node < virtual_end);
  }
};

/// How many moves there were, as the host gave it or, with `frame`, as the device knows it.
struct MoveCount {
  Index count = 0;
  View<const FrameParams> frame = {};
  TACTUS_HD void load() {
    if (!frame.empty()) count = frame[0].substeps;
  }
  TACTUS_HD bool is_odd() const { return (count & 1) != 0; }
};

/// The worst of some cubes.
struct CubeExtremes {
  float speed_ratio;  ///< fastest wave over that at rest
  Index fastest_cube;
  float smallest_J;
  Index smallest_cube;
  Index inverted;  ///< cubes with J <= 0
  CubeExtremes counted_from(Index first_cube) const {
    return {speed_ratio, fastest_cube + first_cube, smallest_J, smallest_cube + first_cube, inverted};
  }
};

}  // namespace tactus::tled
