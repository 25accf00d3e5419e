#pragma once
/// Blades of a scene that a program moves.
#include <string>
#include <vector>

#include "tactus/geom/mesh/mesh.h"
#include "tactus/sim/held_pose.h"
#include "tactus/sim/scene.h"
#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus {

/// Names of all obstacles and blades with `held: true`, obstacles first.
std::vector<std::string> held_names(const Scene& scene);

/// Poses of the blades with `held: true`, frame by frame. Their coordinates are the world's until a pose is
/// set.
class HeldBlades {
 public:
  explicit HeldBlades(const Scene& scene);
  bool has(const std::string& name) const;
  /// Where a blade is at the end of the next frame and of those after it. @throws usage Error for a pose that
  /// is not finite or not rigid. @param name has(name) is true @param at_once as a jump of begin_frame()
  void set_pose(const std::string& name, const Rigidd& T_world_blade, bool at_once = false);
  /// At the end of the last frame.
  Rigidd pose(const std::string& name) const;
  /// Takes in where they are at the end of a frame. @param jumps they are there at once: nothing is swept
  void begin_frame(bool jumps);
  /// Strip that the edge swept in this frame; no points after a jump.
  cut::BladeStrip strip(const std::string& name, int frame) const;
  /// World, at the frame's end.
  std::vector<TriangleMesh> meshes() const;
  void archive(StateArchive& a);

 private:
  struct Held {
    BladeDescription blade;
    HeldPose pose;
    Rigidd before;
    bool has_jumped = true;
  };
  const Held& find(const std::string& name) const;

  std::vector<Held> all_;
};

}  // namespace tactus
