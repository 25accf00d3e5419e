#pragma once
/// Video and contact sheet of a run.
#include <memory>
#include <string>

#include "tactus/view/image_files.h"
#include "tactus/view/renderer.h"
#include "tactus/world/world.h"

namespace tactus {

/// Draws snapshots of a scene and keeps them as `NAME.mp4` and `NAME.png` (contact sheet) in a folder.
class RunPictures {
 public:
  /// @throws Error when there is no OpenGL 4.5 or the folder can't be written.
  RunPictures(const Scene& scene, const Rig& rig, const BodyAssets& assets, const World& world,
              const std::string& stem, double fps);

  /// Colours bodies by their model of deformation: per body and triangle of its surface, 1 where elements
  /// deform it.
  void show_models(std::vector<std::vector<std::uint8_t>> element_triangles);
  /// @param photos of the rig's cameras: worn where the scene wants it
  /// @param overlay one line on the picture  @param caption short, under its cell of the contact sheet
  void add(FrameSnapshot snapshot, const std::vector<ColorImage>& photos, const std::string& overlay,
           const std::string& caption);
  /// The newest.
  const ColorImage& picture() const { return picture_; }
  /// Closes the files. Does nothing but close when no frame came.
  void finish();

 private:
  const Scene scene_;
  Renderer renderer_;
  ViewCamera camera_;
  std::shared_ptr<ViewPhotos> photos_;  ///< none: the real surface is clay
  ViewScene view_;  ///< still contents (cameras, workspace, obstacles) and the meshes of the newest frame
  std::size_t still_meshes_ = 0;                    ///< obstacles and cameras: the first of `view_.meshes`
  std::size_t still_lines_ = 0, still_labels_ = 0;  ///< likewise: the cameras'
  std::unique_ptr<VideoWriter> video_;
  std::unique_ptr<ContactSheet> sheet_;
  std::string sheet_path_;
  std::vector<std::vector<std::uint8_t>> element_triangles_;
  ColorImage picture_;
  int frames_ = 0;
};

/// For show_models.
std::vector<std::vector<std::uint8_t>> element_triangles(World& world);

}  // namespace tactus
