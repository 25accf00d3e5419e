#pragma once
/// A soft body's surface as a wall of a liquid.
#include <functional>

#include "tactus/contact/walls/active_walls.h"
#include "tactus/contact/walls/near_surface.h"
#include "tactus/geom/search/neighbour_search.h"
#include "tactus/multi_device/device_barrier.h"

namespace tactus {

/// A body's surface, for BodyWalls.
struct WallSurface {
  WallChange all;                    ///< triangles are counter-clockwise from outside
  WallMesh::Capacity capacity = {};  ///< where a cut may add some; no less than the surface needs is taken
  float lattice_spacing_m = 0;
  Box3f box_m;         ///< where the liquid is
  ContactNodes nodes;  ///< the views stay valid
};

/// Owns the surface of one body. Its nodes are on the first device; all devices that have particles have a
/// copy of its vertices. Per step of the liquid, once particles are sorted: begin, pose, and find_walls of
/// each part; once the liquid told the impulses on walls, push of each part, then end_push. Asynchronous, may
/// be recorded. When the body was cut, apply: recordings stay valid.
///
/// Where the liquid is on one device, the cost of a step follows the part of the surface near the liquid. On
/// several, each looks at all vertices and triangles of the surface; at its short edges only where particles
/// are.
class BodyWalls {
 public:
  /// Edges of triangles at rest are no longer than that, in spacings of the particles.
  static constexpr float kLongestEdge = 4;
  /// @param parts of the liquid, on the first devices @param collider of its walls
  /// @param particle_spacing_m d of the liquid @param max_particles of each part. Synchronizes.
  BodyWalls(DeviceSet& devices, int parts, const WallSurface& surface, Index collider,
            float particle_spacing_m, Index max_particles);

  using Particles = std::function<const NeighbourSearch&(int part)>;
  /// Finds the space near these particles. The body may move meanwhile.
  void begin(const Particles& particles);
  /// Where the surface is now, near those particles. Before find_walls of them.
  void pose();
  void find_walls(int part, const NeighbourSearch& particles, const NearWalls& near);
  /// For particles that only ask. @param hits kWallSides of each particle, written
  void find_walls(int part, const NeighbourSearch& particles, const NearWalls& near, View<WallHit> hits);
  void push(int part, const NeighbourSearch& particles, const NearWalls& near);
  /// The nodes take the impulses of all parts.
  void end_push();

  /// Takes a cut over, between frames. Synchronizes.
  void apply(const WallChange& change);
  /// There was no capacity for a piece of the surface: the liquid doesn't feel it.
  bool is_full() const { return mesh_.is_full(); }

 private:
  /// On one device. Vertices that halving added are behind the capacity for the others.
  struct Part {
    Part(ExecContext& ctx, const WallMesh& mesh, const WallGrid& grid, Index nodes, float search_reach_m,
         Index max_particles);
    Count vertices(Index capacity) const { return {counts.const_view().part(0, 1), capacity}; }
    Count all_added() const { return {counts.const_view().part(1, 1), added.size()}; }
    Count listed_ones() const { return {counted(NearCounts::kListedTriangles), listed.size()}; }
    Count pieces() const { return {counted(NearCounts::kListedPieces), number.size()}; }
    Count chosen_particles() const { return {counted(NearCounts::kChosenParticles), near_particles.size()}; }
    View<const Index> counted(Index which) const {
      return {reinterpret_cast<const Index*>(near_counts.const_view().data()) + which, 1};
    }
    NearSurface near_surface() const;
    NeighbourSearch search;
    Buffer<Index> counts;  ///< of vertices, added ones, triangles of the surface
    Buffer<Vec3i> surface, triangles;
    Buffer<WallVertex> added;
    IndexLists added_of, pieces_of;  ///< triangles of the surface
    Buffer<PosedVertex> posed;
    Buffer<VertexImpulse> impulse;  ///< of added vertices, zero but between push and end_push
    ActiveWalls active;
    // Triangles and pieces near particles:
    Buffer<std::uint32_t> marks;  ///< and behind them, the counts of a WallRefresh
    Buffer<std::uint32_t> near;
    Buffer<std::uint32_t> near_counts;  ///< NearCounts
    Buffer<Index> listed, number;
    Buffer<Vec3i> corners;
    Buffer<Vec3f> middle_m;
    Buffer<float> radius_m;
    Buffer<Vec3f> normals;
    Buffer<Index> near_particles;  ///< if chooses_particles()
    Buffer<WallHit> hits;
  };
  static std::size_t at(int part) { return static_cast<std::size_t>(part); }
  void upload();
  /// Whether active sets follow the liquid. Those of several devices would be chosen by one, for all. A GPU
  /// goes through all of a surface in less time than the launches take that follow it.
  bool follows() const { return parts_.size() == 1 && !devices_.is_cuda(); }
  /// Whether those that may be near are listed first. On a GPU a block looks for each one's walls; one core
  /// of a CPU looks for those of a run of particles together, which a list would tear apart.
  bool chooses_particles() const { return !follows(); }
  WallRefresh refresh_of(Part& part) const;
  PoseWallVertices pose_of(Part& first) const;
  void find_near_cells(int part, const NeighbourSearch& particles);
  void choose_active();
  void copy_vertices();
  void list_triangles(int part);

  DeviceSet& devices_;
  DeviceBarrier barrier_;
  ContactNodes nodes_;
  Index collider_;
  float reach_m_, crowd_;
  WallGrid grid_;
  WallMesh mesh_;
  std::vector<Part> parts_;
  // On the first device:
  Buffer<EmbeddedPoint> points_;
  Buffer<VertexImpulse> node_impulse_;
};

}  // namespace tactus
