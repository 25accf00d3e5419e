#pragma once
/// Optional smoothing of a reconstructed mesh, on the device that holds it.
#include "tactus/compute/exec_context.h"
#include "tactus/geom/mesh/mesh_view.h"
#include "tactus/reconstruct/visual_hull.h"

namespace tactus {

/// Takes the grain of grid and masks off a mesh, keeps its edges (more than 60 degrees between faces stay as
/// they are) and its volume: to 1e-4 of it for closed meshes. Vertices leave the silhouettes by the grain
/// that is taken off. The same bits on every device.
class SurfaceSmoothing {
 public:
  SurfaceSmoothing(Device& device, Index max_vertices, Index max_triangles);
  /// The mesh with its vertices moved; triangles and counts are those of `mesh`, which is not changed. Valid
  /// until the next call. Asynchronous; allocates nothing after its first call, and may then be recorded.
  /// @param edge_m typical edge (the voxel) [m]  @param steps 1 or more; each looks one ring of triangles
  /// farther
  /// @throws Error when the mesh has more capacity than this, or for numbers out of range.
  MeshView smooth(ExecContext& ctx, const MeshView& mesh, float edge_m, int steps);
  /// (max_vertices) As the last call left them.
  View<const Vec3f> positions_m() const { return positions_.const_view(); }

 private:
  void find_fans(ExecContext& ctx, const MeshView& mesh);
  /// Normals, areas and the volume of the mesh with these vertices.
  void measure(ExecContext& ctx, const MeshView& mesh, View<const Vec3f> positions_m, View<float> volume_m3);
  void restore_volume(ExecContext& ctx, const MeshView& mesh, View<Vec3f> positions_m, float edge_m);

  Buffer<std::uint32_t> corner_vertices_, vertices_scratch_;
  Buffer<Index> corners_, corners_scratch_, fan_begin_;
  Buffer<Vec3f> normals_, filtered_, directions_, positions_, moved_;
  Buffer<float> areas_, volumes_, growth_, sums_, sum_scratch_;
};

}  // namespace tactus
