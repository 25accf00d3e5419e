#pragma once
/// From the silhouettes of a frame to its surface: hull, mesh, smoothed where that is asked for, and normals.
/// All code that reconstructs uses this, so a surface is the same wherever it is made.
#include "tactus/frame/stage.h"
#include "tactus/geom/mesh/mesh_view.h"
#include "tactus/reconstruct/surface_smoothing.h"
#include "tactus/reconstruct/texture/surface_texture.h"
#include "tactus/reconstruct/visual_hull.h"

namespace tactus {

struct SurfaceOptions {
  HullOptions hull;
  int smoothing_steps = 0;  ///< that keep edges and volume; each looks one triangle farther; 0 to 100
};

class SurfacePipeline {
 public:
  /// @throws Error as VisualHull's, or naming smoothing_steps.
  SurfacePipeline(DeviceSet& devices, std::span<const Camera> cameras, std::span<const Camera> depth_cameras,
                  const SurfaceOptions& options);

  /// The stages of a frame with new images. "hull/upload" calls `upload`, which is to send them by
  /// hull().upload. They write VisualHull::kMesh.
  std::vector<Stage> stages(std::function<void()> upload);

  /// All of it at once. Asynchronous.
  void make(std::span<const BitMask> silhouettes, std::span<const DepthImage> depths_m = {});
  /// Normals of the surface's vertices; pictures need them, contact doesn't. Asynchronous.
  void compute_normals();

  /// In the memory of the first device.
  MeshView surface() const;
  /// As compute_normals() left them.
  View<const Vec3f> normals() const { return normals_.view(); }
  /// The surface with its normals, which are computed. Synchronizes.
  TriangleMesh download();
  /// The same where it lies: views of just its vertices and triangles; empty before the first. Synchronizes.
  /// @throws Error when it is incomplete, naming the option to raise.
  MeshView finished();

  VisualHull& hull() { return hull_; }
  const VisualHull& hull() const { return hull_; }
  float voxel_size_m() const { return hull_.voxel_size_m(); }

 private:
  void smooth();
  DeviceSet& devices_;
  int smoothing_steps_;
  VisualHull hull_;
  std::optional<SurfaceSmoothing> smoothing_;
  SurfaceNormals normals_;
  bool is_made_ = false;  ///< images came
};

}  // namespace tactus
