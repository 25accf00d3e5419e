#pragma once
/// A soft body's surface as a wall of a liquid.
#include <span>
#include <vector>

#include "tactus/contact/body_wall_kernels.h"
#include "tactus/geom/cube_lattice.h"
#include "tactus/geom/mesh.h"
#include "tactus/geom/neighbour_search.h"
#include "tactus/multi_device/device_barrier.h"

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

/// Owns the surface of one body, whose nodes are on the first device, and copies of it on all that particles
/// are on. Per step of the liquid: once it sorted its particles, pose, then find_walls of each part; once it
/// told the impulses on walls, push of each part, then end_push. Asynchronous, may be recorded.
class BodyWalls {
 public:
  /// Edges of triangles at rest are no longer than that, in spacings of the particles.
  static constexpr float kLongestEdge = 1;
  /// @param surface with such edges @param owner of its walls @param particle_spacing_m d of the liquid
  /// @param parts of the liquid, on the first devices @param max_particles of each. Synchronizes.
  BodyWalls(DeviceSet& devices, int parts, const WallSurface& surface, Index owner, float particle_spacing_m,
            Index max_particles);

  void pose();
  void find_walls(int part, const NeighbourSearch& particles, const NearWalls& near);
  void push(int part, const NeighbourSearch& particles, const NearWalls& near);
  void end_push();

 private:
  /// On one device.
  struct Part {
    Part(ExecContext& ctx, const WallSurface& surface, float search_reach_m, Index max_particles);
    NeighbourSearch search;
    Buffer<Vec3i> triangles;
    Buffer<PosedVertex> posed;
    Buffer<VertexImpulse> impulse;
    Buffer<Vec3f> middle_m;
    Buffer<float> radius_m;
    Buffer<WallHit> hits;
  };
  Part& part(int p) { return parts_[static_cast<std::size_t>(p)]; }

  DeviceSet& devices_;
  DeviceBarrier barrier_;
  ContactNodes nodes_;
  Index owner_;
  float reach_m_, crowd_;
  std::vector<Part> parts_;
  // On the first device:
  Buffer<EmbeddedPoint> points_;
  Buffer<Index> node_, first_, incident_;
};

}  // namespace tactus
