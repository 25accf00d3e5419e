#pragma once
/// Points spread over a body's surface that move with the nodes of its lattice. Contact acts on them.
#include <span>
#include <vector>

#include "tactus/geom/lattice/cube_lattice.h"

namespace tactus {

/// A point on a surface and the area that it stands for.
struct SpreadPoint {
  Vec3f x_m;
  float area_m2 = 0;
};

/// Points on the triangles of a mesh, no two on the same side nearer than 0.6 spacings, no surface farther
/// than 1.3 spacings from all of them. Vertices come first, so corners and edges keep their points. The areas
/// add up to the mesh's.
/// @throws Error for a spacing that is not positive.
std::vector<SpreadPoint> spread_points(const TriangleMesh& mesh, float spacing_m);

/// A point that moves with a body: x = sum_k weight[k] x_node[k].
struct EmbeddedPoint {
  Index node[8];      ///< the largest weight first
  float weight[8];    ///< they sum to 1; 0 for nodes that don't count
  float area_m2 = 0;  ///< at rest
  /// Where it is, of node_m(k) of its nodes. Differences are weighted, so that weights that are rounded don't
  /// move it.
  template <class F>
  TACTUS_HD Vec3f position(F&& node_m) const {
    const Vec3f base = node_m(0);
    Vec3f sum{};
    for (int k = 1; k < 8; ++k) sum += weight[k] * (node_m(k) - base);
    return base + sum;
  }
  template <class F>
  TACTUS_HD Vec3f velocity(F&& node_m_s) const {
    Vec3f sum{};
    for (int k = 0; k < 8; ++k) sum += weight[k] * node_m_s(k);
    return sum;
  }
};

/// Which way a wall of a cut faces: sum_k weight[k] x_node[k], with the nodes of a point on it, is where a
/// step of one spacing out of the material at rest leads. All 0: the point is on no wall.
struct WallSide {
  float weight[8] = {};
};

/// A point of a body that was cut: it is new, or moves with other nodes from now on.
struct PointChange {
  Index point = 0;
  EmbeddedPoint to;
  Index cube = -1;  ///< or copy, whose nodes those are
  Vec3f rest{};     ///< where it rests, in spacings from node (0, 0, 0)
  Vec3f wall{};     ///< of the wall of a cut, the normal away from its material; 0: it is on none
  WallSide side{};  ///< the same, as the nodes of `to` tell it; 0 also where the wall can't be parted
};

/// @param cube_of the cube that holds each point, or is nearest to it @param local_of where in that cube, in
/// spacings from its corner 0
std::vector<EmbeddedPoint> embed_points(const CubeLattice& lattice, std::span<const SpreadPoint> points,
                                        std::span<const Index> cube_of, std::span<const Vec3f> local_of);

}  // namespace tactus
