#pragma once
/// Internal forces of nodes, from tiles and from copies of cubes that were cut.
#include "tactus/geom/arrays/vector_fields.h"

namespace tactus::tled {

/// Corners of copies, sorted by node. Those of one node follow each other in ascending order of copies.
struct CornersOfNodes {
  View<const Index> first;         ///< per node that copies have: its first corner
  View<const std::uint32_t> node;  ///< per corner
  View<const Index> corner;        ///< 8 copy + q
  View<const Vec3f> f_N;           ///< eight per copy
  TACTUS_HD Index node_of(Index i) const { return static_cast<Index>(node[first[i]]); }
  TACTUS_HD Vec3f force(Index i) const { return force_from(first[i]); }
  /// Of the node whose first corner that is.
  TACTUS_HD Vec3f force_from(Index begin) const {
    const std::uint32_t own = node[begin];
    Vec3f sum{};
    for (Index e = begin; e < node.size() && node[e] == own; ++e) sum += f_N[corner[e]];
    return sum;
  }
};

struct SummedForces {
  View<const float> of_tiles_N;  ///< 3 fields over cells
  Index cells = 0;
  Index first_virtual_cell = 0;  ///< tiles have none from there on
  CornersOfNodes corners = {};
  View<const Index> first_of_node = {};  ///< per node: its first corner; -1: copies don't have it; empty: any
  TACTUS_HD Vec3f at(Index node, Index cell) const {
    const Vec3f of_tiles = cell < first_virtual_cell ? vector_at(of_tiles_N, cells, cell) : Vec3f{};
    const Index begin = first_of_node.empty() ? -1 : first_of_node[node];
    return begin < 0 ? of_tiles : of_tiles + corners.force_from(begin);
  }
};

}  // namespace tactus::tled
