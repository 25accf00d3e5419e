#pragma once
/// Thumbnails of a rig's cameras between the panels. Internal to window/.
#include "tactus/view/gl_objects.h"
#include "tactus/window/camera_model.h"
#include "tactus/window/camera_moves.h"

namespace tactus {

/// The window's OpenGL context is current wherever this is used.
class CameraStrip {
 public:
  /// Keeps pictures of the newest images. @param photos of the same frame: one per camera, or none
  void take(std::shared_ptr<const CameraLook> look, const std::vector<ColorImage>& photos);
  /// A run begins anew.
  void clear();
  bool is_empty() const { return look_ == nullptr; }
  CameraModel model(const RigCheckup& checkup) const;
  /// Between ImGui's begin and end of a picture, at its bottom. @param scale of text
  void draw(const CameraModel& model, float scale);
  /// Faults, where the cameras are in the scene.
  static void draw_faults(const CameraModel& model, const ViewCamera& camera, float scale);

 private:
  struct Thumb {
    GlTexture texture;
    Vec2i size_px;
  };
  void draw_camera(const CameraModel::Camera& camera, const Thumb& thumb, float width, float scale);

  std::shared_ptr<const CameraLook> look_;
  std::vector<double> shares_;  ///< of the newest images
  std::vector<Thumb> thumbs_;
};

}  // namespace tactus
