#include "tactus/sim/still_solids.h"

#include <algorithm>
#include <cmath>

namespace tactus {

StillSolids::StillSolids(std::span<const std::unique_ptr<SoftBody>> bodies,
                         std::span<const ObstacleDescription> obstacles)
    : obstacles_(obstacles) {
  for (const auto& body : bodies) add(nullptr, body->shape().surface_m, body->description().shape.fill, {});
  for (const ObstacleDescription& o : obstacles)
    if (o.kind == ObstacleKind::mesh && !o.moves)
      add(&o, o.mesh, MeshFill::closed, inverse(o.T_world_obstacle));
}

bool StillSolids::hold(Vec3f x_m, float least_m, const ObstacleDescription* but) const {
  for (const Solid& s : meshes_) {
    if (but != nullptr && s.obstacle == but) continue;
    const Vec3f p = s.T_mesh_world * x_m, out = max(s.low_m - p, p - s.high_m);
    if (std::max({out.x, out.y, out.z}) < least_m && s.query->signed_distance_m(p) < least_m) return true;
  }
  for (const ObstacleDescription& o : obstacles_) {
    if (&o == but || o.moves) continue;
    const Vec3f p = inverse(o.T_world_obstacle) * x_m;
    if (o.kind == ObstacleKind::plane && p.y < least_m) return true;
    if (o.kind != ObstacleKind::box) continue;
    const Vec3f out = Vec3f{std::abs(p.x), std::abs(p.y), std::abs(p.z)} - o.half_m;
    if (std::max({out.x, out.y, out.z}) < least_m) return true;
  }
  return false;
}

void StillSolids::add(const ObstacleDescription* obstacle, const TriangleMesh& mesh, MeshFill fill,
                      const Rigidf& T_mesh_world) {
  if (mesh.positions_m.empty()) return;
  Solid s{obstacle, std::make_unique<PointInMesh>(mesh, fill), T_mesh_world, mesh.positions_m.front(),
          mesh.positions_m.front()};
  for (const Vec3f& p : mesh.positions_m) s.low_m = min(s.low_m, p), s.high_m = max(s.high_m, p);
  meshes_.push_back(std::move(s));
}

}  // namespace tactus
