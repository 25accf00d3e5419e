#include "tactus/sim/still_obstacles.h"

#include "tactus/geom/mesh/box_surface.h"
#include "tactus/geom/mesh/sphere_surface.h"

namespace tactus {

std::vector<StillObstacle> still_obstacles(const Scene& scene, const BodyAssets& assets) {
  std::vector<StillObstacle> all;
  for (const ObstacleSetting& o : scene.obstacles) {
    if (o.kind == ObstacleShape::plane || o.moves()) continue;
    StillObstacle& shown = all.emplace_back(StillObstacle{o.name, {}});
    shown.mesh = o.kind == ObstacleShape::box      ? box_surface(0.5F * vec_cast<float>(o.size_m), {1, 1, 1})
                 : o.kind == ObstacleShape::sphere ? sphere_surface(static_cast<float>(o.radius_m), 16)
                                                   : assets.obstacle_meshes.at(o.name);
    shown.mesh.normals.clear();
    for (Vec3f& p : shown.mesh.positions_m) p = vec_cast<float>(o.placement.to_world(vec_cast<double>(p)));
    if (o.kind != ObstacleShape::box) compute_normals(shown.mesh);
  }
  return all;
}

}  // namespace tactus
