#include "tactus/sim/held_pose.h"

#include <algorithm>
#include <cmath>

#include "tactus/base/error.h"
#include "tactus/sim/body/body_point.h"

namespace tactus {
namespace {

/// The largest entry of R^T R - 1; not finite where R isn't.
double off_rotation(const Mat3d& R) {
  double off = 0;
  const Mat3d product = transpose(R) * R;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) {
      const double by = std::abs(product(i, k) - (i == k ? 1 : 0));
      if (!std::isfinite(by)) return by;
      off = std::max(off, by);
    }
  return off;
}

}  // namespace

Rigidd rigid_pose(const std::string& thing, const Rigidd& T) {
  constexpr double kExact = 1e-9, kNear = 1e-3, kMost_m = 1e6;
  if (const double far_m = length(T.t); !(far_m <= kMost_m))
    throw usage_error("pose of " + thing + ": its position " + point_text(T.t) +
                      " m is expected to be finite, and at most 1e6 m away");
  const double off = off_rotation(T.R);
  if (!(off <= kNear))
    throw usage_error("pose of " + thing + ": R^T R differs from 1 by " + number_text(off) +
                      ", expected a rotation: at most " + number_text(kNear));
  if (dot(cross(T.R.column(0), T.R.column(1)), T.R.column(2)) < 0)
    throw usage_error("pose of " + thing + ": R mirrors, expected a rotation");
  Rigidd exact = T;
  // Newton's iteration for the polar decomposition; each step squares the error.
  for (int step = 0; step < 3 && off_rotation(exact.R) > kExact; ++step) {
    const Mat3d product = transpose(exact.R) * exact.R;
    Mat3d correction = Mat3d::identity();
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) correction(i, k) = (i == k ? 1.5 : 0) - 0.5 * product(i, k);
    exact.R = exact.R * correction;
  }
  return exact;
}

void HeldPose::set_next(const std::string& thing, const Rigidd& T_world_thing, bool at_once) {
  next = rigid_pose(thing, T_world_thing);
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
