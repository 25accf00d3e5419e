#include <mutex>

#include "tactus/run/scene_view.h"
#include "tactus/run/sinks.h"
#include "tactus/sim/scene.h"
#include "tactus/view/renderer.h"

namespace tactus {
namespace {

/// One for all pictures: to start OpenGL takes longer than a picture. It ends with the process, whose driver
/// may be gone before destructors of statics run.
Renderer& shared_renderer(Index width_px, Index height_px) {
  static Renderer* const renderer = new Renderer({.width_px = width_px, .height_px = height_px});
  renderer->resize(width_px, height_px);
  return *renderer;
}

}  // namespace

ColorImage picture_of(World& world, Scene scene, const Rig& rig, const BodyAssets& assets) {
  static std::mutex pictures;
  const std::scoped_lock lock(pictures);
  scene.view.photographs = 0;
  SceneView view(scene, rig, assets, world);
  view.show(world.snapshot(), {});
  ColorImage image;
  shared_renderer(scene.view.size_px.x, scene.view.size_px.y).render(view.scene(), view.camera(), image);
  return image;
}

}  // namespace tactus
