#pragma once
/// Obstacles of a scene: those that stand still, and those that are moved by keyframes or by a program.
#include <map>

#include "tactus/contact/obstacles.h"
#include "tactus/sim/body/body_shape.h"
#include "tactus/sim/held_pose.h"
#include "tactus/sim/reach.h"

namespace tactus {

/// All obstacles of the scene, in its order. One that moves is a mesh in its own coordinates.
std::vector<ObstacleDescription> obstacle_descriptions(const Scene& scene, const BodyAssets& assets);
/// Those that stand still.
std::vector<ObstacleDescription> still_ones(std::vector<ObstacleDescription> obstacles);

/// Poses of the obstacles that move, frame by frame. Within a frame each goes evenly from where it was at the
/// frame's beginning to where it is at its end.
class MovingObstacles {
 public:
  MovingObstacles(const Scene& scene, std::span<const ObstacleDescription> obstacles);
  bool empty() const { return all_.empty(); }
  /// Where a held obstacle is at the end of the next frame and of those after it. It turns the shorter way:
  /// by less than half a turn a frame. @param T_world_obstacle rigid; the scale of its placement stays
  /// @param at_once it is there from the frame's beginning on
  /// @throws usage Error for a pose that is not finite or not rigid. @param name of a held obstacle
  void set_pose(const std::string& name, const Rigidd& T_world_obstacle, bool at_once = false);
  /// @throws usage Error for a name that no moving obstacle has.
  Rigidd pose(const std::string& name) const;
  /// Takes in where they are at the end of a frame. @param dt_s its length; 0: they jump there
  /// @param end_s simulated time at its end @param end_age_s of the real surface then: poses count from its
  /// capture
  void begin_frame(double dt_s, double end_s, double end_age_s);
  /// Their poses at the frame's end.
  std::vector<Rigidd> poses() const;
  /// Motion of each obstacle, for contact.
  std::vector<ToolMotion> motions() const;
  /// The reach of each, at the frame's end.
  std::vector<Reach> reaches() const;
  /// World, at the frame's end.
  std::vector<TriangleMesh> meshes() const;
  void archive(StateArchive& a);

 private:
  struct Moving {
    ObstacleSetting setting;
    TriangleMesh mesh;  ///< in its coordinates, scaled
    Vec3d center_m;     ///< of its box, likewise
    HeldPose pose;
    ToolMotion motion;
  };
  Moving& held(const std::string& name);
  static Rigidd at_rest(const ObstacleSetting& setting);
  static Rigidd along_keyframes(const ObstacleSetting& setting, double time_s);

  std::vector<Moving> all_;
};

}  // namespace tactus
