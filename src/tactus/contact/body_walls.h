#pragma once
/// A soft body's surface as a wall of a liquid.
#include "tactus/contact/body_wall_kernels.h"
#include "tactus/geom/neighbour_search.h"

namespace tactus {

/// A body's surface, for BodyWalls.
struct WallSurface {
  WallChange all;            ///< triangles are counter-clockwise from outside
  WallMesh::Room room = {};  ///< where a cut may add some; no less than the surface needs is taken
  float lattice_spacing_m = 0;
  ContactNodes nodes;  ///< the views stay valid
};

/// Owns the surface of one body, on one device. Per step of the liquid: pose; once the liquid sorted its
/// particles, find_walls; once it told the impulses on walls, push. Asynchronous, may be recorded. When the
/// body was cut, apply: recordings stay valid.
class BodyWalls {
 public:
  /// Edges of triangles at rest are no longer than that, in spacings of the particles.
  static constexpr float kLongestEdge = 1;
  /// @param owner of its walls @param particle_spacing_m d of the liquid
  /// @param max_particles of the liquid. Synchronizes.
  BodyWalls(ExecContext& ctx, const WallSurface& surface, Index owner, float particle_spacing_m,
            Index max_particles);

  /// Where the surface is now. Before find_walls.
  void pose(ExecContext& ctx);
  void find_walls(ExecContext& ctx, const NeighbourSearch& particles, const NearWalls& near) {
    find_walls(ctx, particles, near, hits_.view());
  }
  /// For particles that only ask. @param hits one per particle, written
  void find_walls(ExecContext& ctx, const NeighbourSearch& particles, const NearWalls& near,
                  View<WallHit> hits);
  void push(ExecContext& ctx, const NeighbourSearch& particles, const NearWalls& near);

  /// Takes a cut over, between frames. Synchronizes.
  void apply(ExecContext& ctx, const WallChange& change);
  /// There was no room for a piece of the surface: the liquid doesn't feel it.
  bool is_full() const { return mesh_.is_full(); }

 private:
  void upload(ExecContext& ctx);
  Count count(Index which, Index room) const { return {counts_.const_view().part(which, 1), room}; }

  ContactNodes nodes_;
  Index owner_;
  float reach_m_, crowd_;
  WallMesh mesh_;
  NeighbourSearch search_;
  Buffer<Index> counts_;  ///< of vertices, added ones, triangles
  Buffer<EmbeddedPoint> points_;
  Buffer<WallVertex> added_;
  Buffer<Vec3i> triangles_;
  Buffer<PosedVertex> posed_;      ///< the added ones behind the room for the others
  Buffer<VertexImpulse> impulse_;  ///< likewise
  Buffer<VertexImpulse> node_impulse_;
  Buffer<Vec3f> middle_m_;
  Buffer<float> radius_m_;
  Buffer<WallHit> hits_;
};

}  // namespace tactus
