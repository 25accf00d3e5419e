#pragma once
/// Video and contact sheet of a run.
#include <memory>
#include <string>
#include <vector>

#include "tactus/run/scene_view.h"
#include "tactus/view/image_files.h"
#include "tactus/view/renderer.h"

namespace tactus {

/// Draws snapshots of a scene and keeps them as `NAME.mp4` and `NAME.png` (contact sheet) in a folder.
class RunPictures {
 public:
  /// @param moments frames on the contact sheet, ascending; none: twelve of all
  /// @throws Error when there is no OpenGL 4.5 or the folder can't be written.
  RunPictures(const Scene& scene, const Rig& rig, const BodyAssets& assets, const World& world,
              const std::string& stem, double fps, std::vector<int> moments = {});

  /// As SceneView's.
  void show_models(std::vector<std::vector<std::uint8_t>> element_triangles) {
    view_.show_models(std::move(element_triangles));
  }
  /// @param photos of the rig's cameras: worn where the scene wants it
  /// @param overlay one line on the picture  @param caption short, under its cell of the contact sheet
  void add(FrameSnapshot snapshot, const std::vector<ColorImage>& photos, const std::string& overlay,
           const std::string& caption);
  /// The newest.
  const ColorImage& picture() const { return picture_; }
  /// Closes the files. Does nothing but close when no frame came.
  void finish();

 private:
  Renderer renderer_;
  SceneView view_;
  bool has_overlay_;
  std::unique_ptr<VideoWriter> video_;
  std::unique_ptr<ContactSheet> sheet_;
  std::string sheet_path_;
  std::vector<int> moments_;
  ColorImage picture_, lone_;  ///< the newest; the only moment, which fills its file
  int frames_ = 0;
};

}  // namespace tactus
