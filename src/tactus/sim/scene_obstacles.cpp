#include "tactus/sim/scene_obstacles.h"

#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/geom/mesh/sphere_surface.h"
#include "tactus/sim/keyframes.h"

namespace tactus {
namespace {

/// Chords of a ball's squares are off by 0.12 % of its radius: (pi / 32)^2 / 8.
constexpr Index kComponentsOfQuarter = 16;

TriangleMesh mesh_of(const ObstacleSetting& setting, const BodyAssets& assets, float scale) {
  if (setting.kind == ObstacleShape::box)
    return box_surface((0.5F * scale) * vec_cast<float>(setting.size_m), {1, 1, 1});
  if (setting.kind == ObstacleShape::sphere)
    return sphere_surface(scale * static_cast<float>(setting.radius_m), kComponentsOfQuarter);
  TriangleMesh mesh = assets.obstacle_meshes.at(setting.name);
  for (Vec3f& p : mesh.positions_m) p *= scale;
  return mesh;
}

}  // namespace

std::vector<ObstacleDescription> obstacle_descriptions(const Scene& scene, const BodyAssets& assets) {
  std::vector<ObstacleDescription> all;
  for (const ObstacleSetting& setting : scene.obstacles) {
    ObstacleDescription& o = all.emplace_back();
    const auto scale = static_cast<float>(setting.placement.scale);
    o.name = setting.name;
    o.moves = setting.moves();
    o.T_world_obstacle = {mat_cast<float>(setting.placement.rotation()),
                          vec_cast<float>(setting.placement.position_m)};
    o.half_m = (0.5F * scale) * vec_cast<float>(setting.size_m);
    o.kind = setting.kind == ObstacleShape::plane             ? ObstacleKind::plane
             : setting.kind == ObstacleShape::box && !o.moves ? ObstacleKind::box
                                                              : ObstacleKind::mesh;
    if (o.kind == ObstacleKind::mesh) o.mesh = mesh_of(setting, assets, scale);
  }
  return all;
}

std::vector<ObstacleDescription> still_ones(std::vector<ObstacleDescription> obstacles) {
  std::erase_if(obstacles, [](const ObstacleDescription& o) { return o.moves; });
  return obstacles;
}

MovingObstacles::MovingObstacles(const Scene& scene, std::span<const ObstacleDescription> obstacles) {
  for (std::size_t o = 0; o < obstacles.size(); ++o) {
    if (!obstacles[o].moves) continue;
    Moving& own = all_.emplace_back();
    own.setting = scene.obstacles[o];
    own.mesh = obstacles[o].mesh;
    own.center_m = vec_cast<double>(bounds(own.mesh).center());
    own.pose.T_world = own.pose.next =
        own.setting.held ? at_rest(own.setting) : along_keyframes(own.setting, 0);
  }
}

Rigidd MovingObstacles::at_rest(const ObstacleSetting& setting) {
  return {setting.placement.rotation(), setting.placement.position_m};
}

Rigidd MovingObstacles::along_keyframes(const ObstacleSetting& setting, double time_s) {
  const Rigidd rest = at_rest(setting);
  const KeyframePose pose =
      keyframe_pose(setting.motion, setting.axis, setting.pivot_m.value_or(rest.t), time_s);
  return {pose.R * rest.R, pose(rest.t)};
}

MovingObstacles::Moving& MovingObstacles::held(const std::string& name) {
  for (Moving& m : all_)
    if (m.setting.held && m.setting.name == name) return m;
  throw Error("'" + name + "' is no obstacle with 'held: true'");
}

void MovingObstacles::set_pose(const std::string& name, const Rigidd& T_world_obstacle, bool at_once) {
  held(name).pose.set_next("obstacle '" + name + "'", T_world_obstacle, at_once);
}

Rigidd MovingObstacles::pose(const std::string& name) const {
  std::vector<std::string> names;
  for (const Moving& m : all_) {
    if (m.setting.name == name) return m.pose.T_world;
    names.push_back(m.setting.name);
  }
  throw usage_error("'" + name + "' is no obstacle that moves" +
                    (names.empty() ? "; the scene has none" : suggestion(name, names)));
}

void MovingObstacles::begin_frame(double dt_s, double end_s, double end_age_s) {
  for (Moving& m : all_) {
    if (!m.setting.held) m.pose.next = along_keyframes(m.setting, end_s);
    const bool moves_there = dt_s > 0 && m.pose.is_placed;
    const Rigidd before = m.pose.advance(), &T_world = m.pose.T_world;
    m.motion = {};
    m.motion.is_there = 1;
    Mat3d R = T_world.R;
    Vec3d center_m = T_world * m.center_m;
    if (moves_there) {
      const Vec3d spin = (1 / dt_s) * vector_of_rotation(T_world.R * transpose(before.R)),
                  velocity = (1 / dt_s) * (center_m - before * m.center_m);
      m.motion.spin_rad_s = vec_cast<float>(spin);
      m.motion.velocity_m_s = vec_cast<float>(velocity);
      // Contact asks for poses by the time since the capture.
      R = rotation_from_vector(-end_age_s * spin) * R;
      center_m -= end_age_s * velocity;
    }
    m.motion.R_world_tool = mat_cast<float>(R);
    m.motion.center_m = vec_cast<float>(center_m);
  }
}

std::vector<Rigidd> MovingObstacles::poses() const {
  std::vector<Rigidd> all;
  for (const Moving& m : all_) all.push_back(m.pose.T_world);
  return all;
}

std::vector<ToolMotion> MovingObstacles::motions() const {
  std::vector<ToolMotion> all;
  for (const Moving& m : all_) all.push_back(m.motion);
  return all;
}

std::vector<Reach> MovingObstacles::reaches() const {
  std::vector<Reach> all;
  for (const Moving& m : all_) {
    const Box3f box = bounds(m.mesh);
    const double radius_m = 0.5 * static_cast<double>(length(box.extent()));
    const Vec3d center_m = m.pose.T_world * m.center_m, half{radius_m, radius_m, radius_m};
    all.push_back({center_m - half, center_m + half,
                   static_cast<double>(length(m.motion.velocity_m_s)) +
                       radius_m * static_cast<double>(length(m.motion.spin_rad_s))});
  }
  return all;
}

std::vector<TriangleMesh> MovingObstacles::meshes() const {
  std::vector<TriangleMesh> all;
  for (const Moving& m : all_) {
    TriangleMesh& mesh = all.emplace_back(m.mesh);
    for (Vec3f& p : mesh.positions_m) p = vec_cast<float>(m.pose.T_world * vec_cast<double>(p));
    for (Vec3f& n : mesh.normals) n = vec_cast<float>(m.pose.T_world.R * vec_cast<double>(n));
  }
  return all;
}

void MovingObstacles::archive(StateArchive& a) {
  for (Moving& m : all_) m.pose.archive(a, "obstacle '" + m.setting.name + "'");
}

}  // namespace tactus
