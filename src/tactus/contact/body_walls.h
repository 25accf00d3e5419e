#pragma once
/// A soft body's surface as a wall of a liquid.
#include "tactus/contact/body_wall_kernels.h"
#include "tactus/geom/neighbour_search.h"
#include "tactus/multi_device/device_barrier.h"

namespace tactus {

/// A body's surface, for BodyWalls.
struct WallSurface {
  WallChange all;            ///< triangles are counter-clockwise from outside
  WallMesh::Room room = {};  ///< where a cut may add some; no less than the surface needs is taken
  float lattice_spacing_m = 0;
  ContactNodes nodes;  ///< the views stay valid
};

/// Owns the surface of one body. Its nodes are on the first device; all devices that have particles have a
/// copy of its vertices. Per step of the liquid: pose; once particles are sorted, find_walls of each part;
/// once the liquid told the impulses on walls, push of each part, then end_push. Asynchronous, may be
/// recorded. When the body was cut, apply: recordings stay valid.
class BodyWalls {
 public:
  /// Edges of triangles at rest are no longer than that, in spacings of the particles.
  static constexpr float kLongestEdge = 1;
  /// @param parts of the liquid, on the first devices @param owner of its walls
  /// @param particle_spacing_m d of the liquid @param max_particles of each part. Synchronizes.
  BodyWalls(DeviceSet& devices, int parts, const WallSurface& surface, Index owner, float particle_spacing_m,
            Index max_particles);

  /// Where the surface is now. Before find_walls.
  void pose();
  void find_walls(int part, const NeighbourSearch& particles, const NearWalls& near) {
    find_walls(part, particles, near, parts_[at(part)].hits.view());
  }
  /// For particles that only ask. @param hits one per particle, written
  void find_walls(int part, const NeighbourSearch& particles, const NearWalls& near, View<WallHit> hits);
  void push(int part, const NeighbourSearch& particles, const NearWalls& near);
  /// The nodes take what all parts pushed.
  void end_push();

  /// Takes a cut over, between frames. Synchronizes.
  void apply(const WallChange& change);
  /// There was no room for a piece of the surface: the liquid doesn't feel it.
  bool is_full() const { return mesh_.is_full(); }

 private:
  /// On one device. Vertices that halving added are behind the room for the others.
  struct Part {
    Part(Device& device, const WallMesh::Room& room, float search_reach_m, Index max_particles);
    Count vertices(Index room) const { return {counts.const_view().part(0, 1), room}; }
    Count added(Index room) const { return {counts.const_view().part(1, 1), room}; }
    Count used_triangles() const { return {counts.const_view().part(2, 1), triangles.size()}; }
    NeighbourSearch search;
    Buffer<Index> counts;  ///< of vertices, added ones, triangles
    Buffer<Vec3i> triangles;
    Buffer<PosedVertex> posed;
    Buffer<VertexImpulse> impulse;
    Buffer<Vec3f> middle_m;
    Buffer<float> radius_m;
    Buffer<WallHit> hits;
  };
  static std::size_t at(int part) { return static_cast<std::size_t>(part); }
  void upload();
  void copy_vertices();
  void sort_triangles();

  DeviceSet& devices_;
  DeviceBarrier barrier_;
  ContactNodes nodes_;
  Index owner_;
  float reach_m_, crowd_;
  WallMesh mesh_;
  std::vector<Part> parts_;
  // On the first device:
  Buffer<EmbeddedPoint> points_;
  Buffer<WallVertex> added_;
  Buffer<VertexImpulse> node_impulse_;
};

}  // namespace tactus
