#include "tactus/sim/held_pose.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"

namespace tactus {

bool is_rigid(const Rigidd& T) {
  double off = 0;
  const Mat3d product = transpose(T.R) * T.R;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) off = std::max(off, std::abs(product(i, k) - (i == k ? 1 : 0)));
  return off < 1e-6 && dot(cross(T.R.column(0), T.R.column(1)), T.R.column(2)) > 0 &&
         std::isfinite(dot(T.t, T.t));
}

void HeldPose::set_next(const std::string& thing, const Rigidd& T_world_thing, bool at_once) {
  if (!is_rigid(T_world_thing))
    throw usage_error("pose of " + thing + ": expected a finite position and a rotation");
  next = T_world_thing;
  is_placed = is_placed && !at_once;
}

Rigidd HeldPose::advance() {
  const Rigidd before = T_world;
  T_world = next;
  is_placed = true;
  return before;
}

void HeldPose::archive(StateArchive& a, const std::string& thing) {
  a.set_owner(thing);
  a.value("pose", T_world);
  a.value("next pose", next);
  a.value("placed", is_placed);
}

}  // namespace tactus
