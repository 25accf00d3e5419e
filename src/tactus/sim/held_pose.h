#pragma once
/// The pose of a thing that a program moves, or a script.
#include <string>

#include "tactus/base/vec.h"
#include "tactus/frame/state_archive.h"

namespace tactus {

/// A pose whose rotation is one to double precision. Rotations of floats and those that many small turns made
/// are off by up to 1e-3: the nearest is taken. @param thing as HeldPose::set_next
/// @throws usage Error for a pose that is not finite, scales or mirrors, or is farther than 1e6 m away.
Rigidd rigid_pose(const std::string& thing, const Rigidd& T);

/// Where a thing is at the end of the last frame, and where it will be at the end of the next.
struct HeldPose {
  Rigidd T_world, next;
  bool is_placed = false;  ///< false: it jumps to `next`, nothing lies between

  /// @param thing "blade 'knife'", for the message @param at_once as a jump
  /// @throws usage Error as rigid_pose()
  void set_next(const std::string& thing, const Rigidd& T_world_thing, bool at_once);
  /// Goes to the next pose. @return the pose before
  Rigidd advance();
  void archive(StateArchive& a, const std::string& thing);
};

}  // namespace tactus
