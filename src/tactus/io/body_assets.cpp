#include "tactus/io/body_assets.h"

#include "tactus/io/label_file.h"
#include "tactus/io/mesh_file.h"

namespace tactus {

BodyAssets load_body_assets(const Scene& scene) {
  BodyAssets assets;
  for (const BodyDescription& body : scene.bodies) {
    if (body.shape.kind == ShapeKind::labels) assets.labels[body.name] = read_label_volume(body.shape.path);
    if (body.shape.kind != ShapeKind::mesh) continue;
    TriangleMesh mesh = read_mesh(body.shape.path);
    for (Vec3f& p : mesh.positions_m) p *= static_cast<float>(body.shape.unit_m);
    assets.meshes[body.name] = std::move(mesh);
  }
  for (const ObstacleSetting& obstacle : scene.obstacles) {
    if (obstacle.kind != ObstacleShape::mesh) continue;
    TriangleMesh mesh = read_mesh(obstacle.path);
    for (Vec3f& p : mesh.positions_m) p *= static_cast<float>(obstacle.unit_m);
    assets.obstacle_meshes[obstacle.name] = std::move(mesh);
  }
  for (const BladeDescription& blade : scene.blades) {
    if (!blade.tracked || blade.tracked->model != BladeShape::mesh) continue;
    TriangleMesh mesh = read_mesh(blade.tracked->path);
    for (Vec3f& p : mesh.positions_m) p *= static_cast<float>(blade.tracked->unit_m);
    assets.blade_meshes[blade.name] = std::move(mesh);
  }
  return assets;
}

}  // namespace tactus
