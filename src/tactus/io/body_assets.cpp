#include "tactus/io/scene_file.h"

#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/geom/mesh/hook_surface.h"
#include "tactus/io/built_in_meshes.h"
#include "tactus/io/labels/label_file.h"
#include "tactus/io/mesh/mesh_file.h"

namespace tactus {
namespace {

/// "its mesh lies 707 km from the origin of its file"
std::string far_text(Vec3d origin_m) {
  char text[96];
  std::snprintf(text, sizeof text, "its mesh lies %.4g km from the origin of its file",
                1e-3 * length(origin_m));
  return text;
}

/// @param of "body 'liver'"
TriangleMesh placed_mesh(const std::string& path, double unit_m, const std::string& of) {
  ImportedMesh imported = import_mesh(path, unit_m);
  if (!(imported.origin_m == Vec3d{}))
    log_warning(of + ": " + far_text(imported.origin_m) + ": its middle is taken as its origin");
  return std::move(imported.mesh);
}

/// As a body's: turned right side out.
TriangleMesh obstacle_mesh(const ObstacleSetting& obstacle) {
  const std::string of = "obstacle '" + obstacle.name + "'";
  TriangleMesh mesh = placed_mesh(obstacle.path, obstacle.unit_m, of);
  if (volume_m3(mesh) >= 0) return mesh;
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  for (Vec3f& normal : mesh.normals) normal = -normal;
  log_warning(of + ": its triangles face inwards; they are taken the other way round");
  return mesh;
}

/// Edge and markers of a blade are in the file's coordinates.
TriangleMesh blade_mesh(const BladeDescription& blade) {
  ImportedMesh imported = import_mesh(blade.tracked->path, blade.tracked->unit_m);
  if (!(imported.origin_m == Vec3d{}))
    throw Error("blade '" + blade.name + "': " + far_text(imported.origin_m) + ", expected at most 0.1 km");
  return std::move(imported.mesh);
}

}  // namespace

BodyAssets load_body_assets(const Scene& scene) {
  BodyAssets assets;
  for (const BodyDescription& body : scene.bodies) {
    if (body.shape.kind == ShapeKind::labels)
      assets.labels[body.name] = std::make_shared<const LabelVolume>(read_label_volume(body.shape.path));
    if (body.shape.kind == ShapeKind::mesh)
      assets.meshes[body.name] = placed_mesh(body.shape.path, body.shape.unit_m, "body '" + body.name + "'");
  }
  for (const ObstacleSetting& obstacle : scene.obstacles) {
    if (obstacle.kind != ObstacleShape::mesh) continue;
    const auto unit_m = static_cast<float>(obstacle.unit_m);
    assets.obstacle_meshes[obstacle.name] =
        obstacle.path == kHookPath ? hook_surface(unit_m, kHookRod * unit_m) : obstacle_mesh(obstacle);
  }
  for (const BladeDescription& blade : scene.blades) {
    if (blade.tracked && blade.tracked->model == BladeShape::mesh)
      assets.blade_meshes[blade.name] = blade_mesh(blade);
  }
  return assets;
}

}  // namespace tactus
