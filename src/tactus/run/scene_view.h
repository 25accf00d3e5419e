#pragma once
/// A scene's snapshots as the renderer draws them.
#include <memory>
#include <string>
#include <vector>

#include "tactus/sim/scene.h"
#include "tactus/view/scene.h"
#include "tactus/view/view_camera.h"
#include "tactus/world/world.h"

namespace tactus {

/// Makes a ViewScene of each snapshot: what stands still (cameras, workspace, obstacles) and the newest
/// frame.
class SceneView {
 public:
  SceneView(const Scene& scene, const Rig& rig, const BodyAssets& assets, const World& world);

  /// Colours bodies by their model of deformation: per body and triangle of its surface, 1 where elements
  /// deform it.
  void show_models(std::vector<std::vector<std::uint8_t>> element_triangles);
  /// @param photos of the rig's cameras: worn where the scene wants it
  void show(FrameSnapshot snapshot, const std::vector<ColorImage>& photos);
  /// The newest snapshot, as the renderer draws it.
  const ViewScene& scene() const { return view_; }
  /// As the scene's `view` says, and its parameters of the newest snapshot.
  const ViewCamera& camera() const { return camera_; }

 private:
  void turn_to(const ViewAngles& angles);
  ViewMesh body_mesh(FrameSnapshot& snapshot, std::size_t b) const;
  ViewMesh real_mesh(FrameSnapshot& snapshot) const;
  ViewLiquid liquid_look() const;
  ViewFilm dry_film() const;
  float spacing_m() const;  ///< of the liquid
  void show_film(WetObstacle wet);
  const Scene scene_;
  Box3f box_m_;        ///< of all that there is at rest
  ViewAngles angles_;  ///< of camera_
  ViewCamera camera_;
  std::shared_ptr<ViewPhotos> photos_;  ///< none: the real surface is clay
  ViewScene view_;
  std::size_t still_meshes_ = 0;                    ///< obstacles and cameras: the first of `view_.meshes`
  std::size_t still_lines_ = 0, still_labels_ = 0;  ///< likewise: the cameras'
  std::vector<std::vector<std::uint8_t>> element_triangles_;
};

/// For show_models.
std::vector<std::vector<std::uint8_t>> element_triangles(World& world);

}  // namespace tactus
