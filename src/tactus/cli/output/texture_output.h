#pragma once
/// Photographic colours of the surfaces that `tactus reconstruct` makes, and pictures of them.
#include <vector>

#include "tactus/geom/mesh/textured_mesh.h"
#include "tactus/reconstruct/texture/surface_texture.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/view/image_files.h"

namespace tactus {

class TextureOutput {
 public:
  /// @throws usage_error when k is not 1 to the number of cameras.
  TextureOutput(DeviceSet& devices, const Rig& rig, const VisualHull& hull, const Box3f& workspace_m,
                Index k);
  /// Each vertex as seen along its own normal. @throws Error when the frame has no photos, or wrong ones.
  void shade(const FrameSet& frame, const MeshView& surface, View<const Vec3f> normals);
  std::vector<Rgb8> colors(Index vertices) const;
  /// `mesh`, which is `surface` on the host, with the photos of the frame on it. After `shade`.
  TexturedMesh textured(const FrameSet& frame, const MeshView& surface, View<const Vec3f> normals,
                        const TriangleMesh& mesh);
  /// Three views from between the cameras, coloured fragment by fragment: a row with k = 1 and one with k.
  ColorImage picture(const MeshView& surface, View<const Vec3f> normals, const TriangleMesh& mesh);

 private:
  DeviceSet& devices_;
  Rig rig_;
  Box3f workspace_m_;
  float voxel_size_m_;
  Index k_;
  SurfaceTexture texture_;
};

}  // namespace tactus
