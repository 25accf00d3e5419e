#pragma once
/// Normals and photographic colours for the vertices of a reconstructed mesh, on the device that holds it.
#include <optional>
#include <span>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"
#include "tactus/geom/mesh/mesh_view.h"
#include "tactus/reconstruct/texture/texture_kernels.h"
#include "tactus/reconstruct/visual_hull.h"

namespace tactus {

/// Unit vertex normals, outward: area-weighted means of the triangles around each vertex, then smoothed once
/// over the ring of neighbours (the facets of marching cubes are noise of the grid, not shape).
class SurfaceNormals {
 public:
  /// @param max_vertices largest mesh, e.g. `hull.mesh().positions_m.size()`
  SurfaceNormals(Device& device, Index max_vertices);
  /// Asynchronous; allocates nothing. @param edge_m typical edge of the mesh (the voxel) [m]
  /// @throws Error when the mesh may have more than max_vertices, or edge_m is not positive.
  void compute(ExecContext& ctx, const MeshView& mesh, float edge_m, int smoothing_steps = 1);
  /// (max_vertices); those of the mesh come first.
  View<const Vec3f> view() const { return normals_.const_view(); }

 private:
  Buffer<std::uint64_t> sums_;
  Buffer<Vec3f> normals_;
};

struct TextureOptions {
  Index k = 1;              ///< cameras that a vertex is coloured from: 1 as in the paper, more are blended
  float voxel_size_m = 0;   ///< of the hull: sets the grain of the visibility test, > 0
  Vec3f center_m{};         ///< middle of the workspace, where that grain is meant
  Index max_vertices = 0;   ///< largest mesh
  Index max_triangles = 0;  ///< largest mesh for `choose`; 0: not used
  int fill_steps = 4;       ///< unseen vertices take their neighbours' colours, this many rings deep
};

/// View-dependent texture (Shao et al. 2019, "Texture mapping") as a pass over vertices.
class SurfaceTexture {
 public:
  /// @throws usage_error: k < 1 or larger than the number of cameras. @throws Error: no or more than 32
  /// cameras, a bad camera, photos of more than 2^31 pixels in all, options out of range.
  SurfaceTexture(ExecContext& ctx, std::span<const Camera> cameras, const TextureOptions& options);

  /// Sends the photos of one tick, one per camera; an empty one: this camera missed the tick. Copied before
  /// it returns. @throws Error naming the camera whose photo has another size than its calibration, or when
  /// there are not as many as cameras.
  void upload(ExecContext& ctx, std::span<const ColorImage> photos);
  /// Colours the vertices for a viewer at `eye_m` (world), or, without, each as seen along its own normal.
  /// Asynchronous; allocates nothing.
  void shade(ExecContext& ctx, const MeshView& mesh, View<const Vec3f> normals,
             std::optional<Vec3f> eye_m = {});

  /// Finds the best photo of every triangle, seen along its normals; for texture atlases. After `shade`,
  /// whose visibility tests it uses. Asynchronous. @throws Error when the mesh may have more than
  /// max_triangles.
  void choose(ExecContext& ctx, const MeshView& mesh, View<const Vec3f> normals);

  /// (max_triangles) number of the camera; -1: no camera sees all of it.
  View<const Index> triangle_cameras() const { return triangle_cameras_.const_view(); }
  /// (max_vertices) packed as VertexColor: r, g, b, and the camera that gave most of it.
  View<const std::uint32_t> colors() const { return colors_.const_view(); }
  /// The photos on the device, one camera after another, row by row; bit c of `live_photos`: camera c has
  /// one.
  View<const Rgb8> photos() const { return photos_.const_view(); }
  CameraBits live_photos() const { return live_; }

 private:
  TextureOptions options_;
  std::vector<Camera> cameras_;
  std::vector<TextureCamera> layout_;
  Buffer<TextureCamera> device_cameras_;
  Buffer<Rgb8> photos_;
  HostBuffer<Rgb8> staging_;
  Buffer<Vec2i> map_rows_;
  Buffer<std::uint32_t> widened_, maps_, colors_;
  Buffer<std::uint64_t> sums_;
  Buffer<Index> triangle_cameras_;
  CameraBits live_ = 0;
};

/// The colour bytes of packed colours; vertices that no camera saw are grey.
std::vector<Rgb8> to_rgb(std::span<const std::uint32_t> packed);

}  // namespace tactus
