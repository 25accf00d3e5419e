#pragma once
/// A triangle mesh that moves with a cube lattice [P 15].
#include "tactus/geom/arrays/index_lists.h"
#include "tactus/geom/arrays/set_values.h"
#include "tactus/geom/lattice/boundary_points.h"
#include "tactus/geom/mesh/mesh.h"
#include "tactus/tissue/body_state.h"
#include "tactus/tissue/cut/flat_lists.h"
#include "tactus/tissue/embedding.h"
#include "tactus/tissue/topology_change.h"

namespace tactus {

/// Where points of a body at rest sit: in a cube, or near one. In a cube that was cut, points sit in the copy
/// that has the nearest corner.
/// @param outward per point the surface's normal, if it lies on one: points on both walls of a cut differ by
/// it
/// @throws Error for one that is further than max_outside spacings from all cubes.
std::vector<embed::Anchor> anchor_points(const CubeLattice& lattice, std::span<const Vec3f> points_m,
                                         float max_outside, std::span<const Vec3f> outward = {});

/// A cube with at least this fill bears loads on its surface.
inline constexpr float kBearingFill = 0.5F;
/// A load on the surface of a cube that holds little would stretch it several times: its own nodes carry next
/// to nothing. So a point there moves with the nearest neighbour of that cube that bears, continued linearly.
/// The cube follows: nothing pulls it.
/// @param anchors of the points, in regular cubes
std::vector<embed::Anchor> bearing_anchors(const CubeLattice& lattice, std::vector<embed::Anchor> anchors);

/// Points spread over a body's surface and moved by its nodes, on which contact acts.
/// @throws Error as anchor_points and spread_points.
std::vector<EmbeddedPoint> surface_points(const CubeLattice& lattice, const TriangleMesh& surface,
                                          float spacing_m, float max_outside = 1);

std::vector<EmbeddedPoint> embed_points(const CubeLattice& lattice, std::span<const SpreadPoint> points,
                                        std::span<const embed::Anchor> anchors);

/// As anchor_points, of a surface's vertices: those on walls of a cut sit in the copy on their own side.
std::vector<embed::Anchor> anchor_vertices(const CubeLattice& lattice, const TriangleMesh& mesh,
                                           float max_outside = 1);

/// How many vertices and triangles a surface can have, when a cut adds some.
struct SurfaceCapacity {
  Index vertices = 0, triangles = 0;
};

/// Owns positions and normals of a surface that a body's nodes move. update() each frame; apply() when the
/// body was cut.
class EmbeddedSurface {
 public:
  /// Vertices outside every cube go to the nearest one (linearly continued); those in cubes that hold little
  /// to the neighbour that bears their loads, unless the body has capacity for a cut.
  /// @param capacity at least for the mesh's vertices and triangles
  /// @throws Error when a vertex is further from all cubes than `max_outside` spacings (which, how far), or
  /// the mesh has no triangles, NaN or a bad index.
  EmbeddedSurface(ExecContext& ctx, const CubeLattice& lattice, const TriangleMesh& mesh,
                  float max_outside = 1, SurfaceCapacity capacity = {});

  /// Positions and normals of all vertices for these node positions. Asynchronous.
  void update(ExecContext& ctx, const BodyState& state);
  /// Takes a cut over: vertices that move with other cubes, new vertices and triangles. Recordings stay
  /// valid. Synchronizes; positions follow with the next update(). @throws Error before anything is changed
  /// when there is no capacity, or an id is out of range.
  void apply(ExecContext& ctx, const TopologyChange& change);

  View<const Vec3f> positions_m() const { return positions_.const_view().part(0, vertex_count()); }
  View<const Vec3f> normals() const { return normals_.const_view().part(0, vertex_count()); }
  /// Three vertices each.
  View<const Index> triangles() const { return triangles_.const_view().part(0, 3 * triangle_count()); }
  View<const embed::Anchor> anchors() const { return anchors_.const_view().part(0, vertex_count()); }
  View<const embed::CubeNodes> cubes() const { return cubes_.view(); }
  Index vertex_count() const { return counts_[0]; }
  Index triangle_count() const { return counts_[1]; }
  // For launches that are recorded once: with their capacity, and how many there are on the device.
  Count vertices() const { return {device_counts_.const_view().part(0, 1), positions_.size()}; }
  Count all_triangles() const { return {device_counts_.const_view().part(1, 1), triangles_.size() / 3}; }
  View<const Vec3f> position_buffer_m() const { return positions_.const_view(); }
  View<const Vec3f> normal_buffer() const { return normals_.const_view(); }
  View<const Index> corner_buffer() const { return triangles_.const_view(); }
  /// Triangles of each vertex.
  const IndexLists& incident() const { return incident_; }
  /// The surface as it is now, on the host. Synchronizes.
  TriangleMesh to_mesh(ExecContext& ctx) const;

 private:
  void check(const TopologyChange& change) const;
  void list_triangles(std::span<const TopologyChange::Triangle> changes);
  void gather_normals(ExecContext& ctx);
  void take_capacity_for_frame(ExecContext& ctx, std::size_t splits);

  std::array<Index, 2> counts_{};  ///< vertices, triangles
  Buffer<Index> device_counts_;
  Buffer<embed::Anchor> anchors_;
  Buffer<embed::CubeNodes> cubes_;
  Buffer<Index> triangles_;
  IndexLists incident_;  ///< triangles of each vertex
  Buffer<Vec3f> positions_, normals_;
  // where a cut may add some; else empty
  std::vector<std::array<Index, 3>> host_triangles_;
  std::vector<std::uint8_t> is_changed_;    ///< per triangle, while a change is taken over
  std::vector<Index> uses_at_;              ///< per vertex, likewise
  std::vector<Index> vertices_;             ///< that change
  std::vector<Index> first_added_, added_;  ///< per vertex in vertices_: triangles that it gets
  std::vector<Index> list_;
  cut::IndexSet changed_vertices_;
  std::vector<SetValues<embed::Anchor>::Change> anchor_changes_;
  std::vector<embed::TriangleChange> triangle_changes_;
  std::vector<SetValues<embed::CubeNodes>::Change> cube_changes_;
  Buffer<SetValues<embed::Anchor>::Change> new_anchors_;
  Buffer<embed::TriangleChange> new_triangles_;
  Buffer<SetValues<embed::CubeNodes>::Change> new_cubes_;
};

}  // namespace tactus
