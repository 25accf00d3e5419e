#pragma once
/// What stands still in a scene, as solids that points may lie in.
#include <memory>
#include <span>
#include <vector>

#include "tactus/contact/obstacles.h"
#include "tactus/geom/mesh/point_in_mesh.h"
#include "tactus/sim/body/soft_body.h"

namespace tactus {

/// Bodies at rest, and obstacles that don't move.
class StillSolids {
 public:
  /// @param obstacles must outlive this; those that move are left out
  StillSolids(std::span<const std::unique_ptr<SoftBody>> bodies,
              std::span<const ObstacleDescription> obstacles);
  /// Whether x lies in something, or nearer than `least_m` to its surface. @param but an obstacle that
  /// doesn't count
  bool hold(Vec3f x_m, float least_m, const ObstacleDescription* but = nullptr) const;

 private:
  struct Solid {
    const ObstacleDescription* obstacle;  ///< nullptr: a body
    std::unique_ptr<PointInMesh> query;
    Rigidf T_mesh_world;
    Vec3f low_m, high_m;
  };
  void add(const ObstacleDescription* obstacle, const TriangleMesh& mesh, MeshFill fill,
           const Rigidf& T_mesh_world);

  std::span<const ObstacleDescription> obstacles_;
  std::vector<Solid> meshes_;
};

}  // namespace tactus
