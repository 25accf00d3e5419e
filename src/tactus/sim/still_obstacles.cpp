#include "tactus/sim/still_obstacles.h"

#include "tactus/geom/mesh/box_surface.h"
#include "tactus/geom/mesh/sphere_surface.h"

namespace tactus {
namespace {

/// A plate stands for the floor of a liquid's box that is above the ground. Its upper side is there.
constexpr float kPlate_m = 0.004F, kOnGround_m = 0.001F;

TriangleMesh plate_below(const BoxRegion& box) {
  const Vec3f low = vec_cast<float>(box.min_m), high = vec_cast<float>(box.max_m);
  TriangleMesh plate =
      box_surface({0.5F * (high.x - low.x), 0.5F * kPlate_m, 0.5F * (high.z - low.z)}, {1, 1, 1});
  const Vec3f middle{0.5F * (low.x + high.x), low.y - 0.5F * kPlate_m, 0.5F * (low.z + high.z)};
  for (Vec3f& p : plate.positions_m) p = p + middle;
  plate.normals.clear();
  return plate;
}

}  // namespace

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
  if (scene.fluid && scene.fluid->open != LiquidOpen::all && scene.fluid->box.min_m.y > double{kOnGround_m})
    all.push_back({kLiquidFloorName, plate_below(scene.fluid->box)});
  return all;
}

}  // namespace tactus
