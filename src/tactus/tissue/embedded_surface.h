#pragma once
/// A triangle mesh that moves with a cube lattice [P 15].
#include "tactus/geom/boundary_points.h"
#include "tactus/geom/mesh.h"
#include "tactus/tissue/body_state.h"
#include "tactus/tissue/embed_kernels.h"

namespace tactus {

/// Where points of a body at rest sit: in a cube, or near one. Of a cube that was cut, in the copy that has
/// the nearest corner.
/// @param outward per point the surface's normal, if it lies on one: points on both walls of a cut differ by
/// it
/// @throws Error for one that is further than max_outside spacings from all cubes.
std::vector<embed::Anchor> anchor_points(const CubeLattice& lattice, std::span<const Vec3f> points_m,
                                         float max_outside, std::span<const Vec3f> outward = {});

/// Points spread over a body's surface, moved by its nodes: what contact acts on.
/// @throws Error as anchor_points and spread_points.
std::vector<EmbeddedPoint> surface_points(const CubeLattice& lattice, const TriangleMesh& surface,
                                          float spacing_m, float max_outside = 1);

class EmbeddedSurface {
 public:
  /// Vertices outside every cube go to the nearest one (linearly continued).
  /// @throws Error when a vertex is further from all cubes than `max_outside` spacings (which, how far), or
  /// the mesh has no triangles, NaN or a bad index.
  EmbeddedSurface(ExecContext& ctx, const CubeLattice& lattice, const TriangleMesh& mesh,
                  float max_outside = 1);

  /// Positions and normals of all vertices for these node positions. Asynchronous.
  void update(ExecContext& ctx, const BodyState& state);

  View<const Vec3f> positions_m() const { return positions_.view(); }
  View<const Vec3f> normals() const { return normals_.view(); }
  View<const Index> triangles() const { return triangles_.view(); }  ///< three vertices each
  View<const embed::Anchor> anchors() const { return anchors_.view(); }
  View<const embed::CubeNodes> cubes() const { return cubes_.view(); }
  Index vertex_count() const { return positions_.size(); }
  Index triangle_count() const { return triangles_.size() / 3; }
  /// The surface as it is now, on the host. Synchronizes.
  TriangleMesh to_mesh(ExecContext& ctx) const;

 private:
  Buffer<embed::Anchor> anchors_;
  Buffer<embed::CubeNodes> cubes_;
  Buffer<Index> triangles_, incident_begin_, incident_;
  Buffer<Vec3f> positions_, normals_;
};

/// Rest signed distance of every node to a closed surface [m], positive outside: contact lets a node that
/// lies outside the surface come nearer by that much (d_i = d0 - outside).
std::vector<float> node_outside_m(const CubeLattice& lattice, const TriangleMesh& surface,
                                  MeshFill fill = MeshFill::closed);
/// The same for a body that is given by its signed distance (negative inside).
std::vector<float> node_outside_m(const CubeLattice& lattice, const std::function<float(Vec3f)>& distance_m);

}  // namespace tactus
