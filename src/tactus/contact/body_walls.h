#pragma once
/// A soft body's surface as a wall of a liquid.
#include <span>
#include <vector>

#include "tactus/contact/body_wall_kernels.h"
#include "tactus/geom/cube_lattice.h"
#include "tactus/geom/mesh.h"
#include "tactus/geom/neighbour_search.h"

namespace tactus {

/// The same surface in triangles whose edges are no longer than that: edges are halved, on both sides alike.
/// @throws Error for a length that is not positive.
TriangleMesh with_short_edges(const TriangleMesh& mesh, float longest_m);

/// A body's surface, for BodyWalls.
struct WallSurface {
  std::vector<EmbeddedPoint> vertices;
  std::vector<Vec3i> triangles;  ///< counter-clockwise from outside
  float lattice_spacing_m = 0;
  ContactNodes nodes;  ///< the views stay valid
};

/// Owns the surface of one body, on one device. Per step of the liquid: once it sorted its particles,
/// find_walls; once it told the impulses on walls, push. Asynchronous, may be recorded.
class BodyWalls {
 public:
  /// Edges of triangles at rest are no longer than that, in spacings of the particles.
  static constexpr float kLongestEdge = 1;
  /// @param surface with such edges @param owner of its walls @param particle_spacing_m d of the liquid
  /// @param max_particles of the liquid. Synchronizes.
  BodyWalls(ExecContext& ctx, const WallSurface& surface, Index owner, float particle_spacing_m,
            Index max_particles);

  void find_walls(ExecContext& ctx, const NeighbourSearch& particles, const NearWalls& near);
  void push(ExecContext& ctx, const NeighbourSearch& particles, const NearWalls& near);

 private:
  ContactNodes nodes_;
  Index owner_;
  float reach_m_, crowd_;
  NeighbourSearch search_;
  Buffer<EmbeddedPoint> points_;
  Buffer<Vec3i> triangles_;
  Buffer<PosedVertex> posed_;
  Buffer<VertexImpulse> impulse_;
  Buffer<Vec3f> middle_m_;
  Buffer<float> radius_m_;
  Buffer<WallHit> hits_;
  Buffer<Index> node_, first_, incident_;
};

}  // namespace tactus
