#pragma once
/// Photographs of a surface on the GPU, and depth maps of each camera's view of it. Internal to view/.
#include "tactus/view/gl_mesh.h"

namespace tactus {

/// The programs, one set a renderer.
struct GlPhotoPrograms {
  GlPhotoPrograms();
  GlProgram map, widen, outline, surface;
};

/// The photos of one surface, and their maps. Slots are reused from frame to frame.
class GlPhotos {
 public:
  GlPhotos();
  /// Sends photos and cameras.
  void upload(const ViewMesh& view);
  /// Draws each camera's depth map of the mesh. Leaves the frame buffer and the view port changed.
  void draw_maps(const GlPhotoPrograms& programs, const GlMesh& mesh, const GlVertexArray& no_attributes);
  /// Binds all that `programs.surface` reads.
  void bind(const GlPhotoPrograms& programs) const;

 private:
  /// As the shader reads it (std140).
  struct DeviceCamera {
    float row_u[4], row_v[4], row_z[4];
    float eye[4], axis[4];
    float photo_width, photo_height, map_width, map_height;
  };
  void resize(const ViewPhotos& photos);
  void set_cameras(const ViewPhotos& photos, const Mat3f& R_world_mesh, CameraBits live);
  void send_from_device(const DeviceSurface& surface);
  void send_from_host(const ViewPhotos& photos);
  void filter(const GlProgram& program, const GlTexture& from, const GlTexture& to) const;

  std::vector<DeviceCamera> cameras_;
  GlStreamBuffer camera_block_, unpack_;
  GlTexture photos_, drawn_, widened_, maps_;
  GlFramebuffer framebuffer_;
  Index photo_width_ = 0, photo_height_ = 0, map_width_ = 0, map_height_ = 0, layers_ = 0;
  Index k_ = 1;
  float bias_m_ = 0;
};

}  // namespace tactus
