#pragma once
/// Results of contact: forces on colliders, over a frame.
#include <cstdint>
#include <vector>

#include "tactus/base/vec.h"

namespace tactus {

/// The law of contact that the real surface follows: by exact distances, or as [P 16-25], which knows no
/// obstacles. The tests `ContactAtRest` compare the two.
enum class ContactResponse : std::uint8_t { exact, paper };

enum class TouchState : std::uint8_t {
  sticking,  ///< friction could take more than it has to
  sliding,   ///< friction is at its limit
  left,      ///< touched in the frame, but not at its end
};

/// Force and impulse of one body on one collider over one frame.
struct ColliderReaction {
  Index collider =
      -1;            ///< < kComponents: component of the real surface, else obstacle collider - kComponents
  Vec3f force_N;     ///< mean force on the collider
  Vec3f torque_N_m;  ///< mean torque about the centre of gravity of all that is real
  Vec3f impulse_N_s;
  float max_depth_m = 0;
  Index contacts = 0;  ///< corrections of points, over all substeps
};

/// Reaction on all that is real over one frame, and counters.
struct ContactReport {
  Vec3f force_N;          ///< mean force on the real object
  Vec3f torque_N_m;       ///< mean torque about the centre of gravity of all that is real
  float max_depth_m = 0;  ///< how deep a point was
  double contacts_per_substep = 0;
  Index pushed_out = 0;                     ///< points that were found deep inside
  std::vector<ColliderReaction> colliders;  ///< those that were touched
  void add(const ContactReport& body);
};

}  // namespace tactus
