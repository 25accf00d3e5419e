#pragma once
/// A motion along keyframes, linear in between.
#include <algorithm>
#include <cmath>
#include <vector>

#include "tactus/geom/maths/rotation.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// x -> pivot + R (x - pivot) + shift, from where a thing is at rest.
struct KeyframePose {
  Mat3d R;
  Vec3d pivot_m, shift_m;
  Vec3d operator()(Vec3d x_m) const { return pivot_m + R * (x_m - pivot_m) + shift_m; }
};

/// Before the first keyframe it is at the first, after the last at the last. @param path two or more
inline KeyframePose keyframe_pose(const std::vector<MotionKeyDescription>& path, Vec3d axis, Vec3d pivot_m,
                                  double time_s) {
  std::size_t k = 1;
  while (k + 1 < path.size() && path[k].time_s < time_s) ++k;
  const MotionKeyDescription &a = path[k - 1], &b = path[k];
  const double share = std::clamp((time_s - a.time_s) / (b.time_s - a.time_s), 0.0, 1.0);
  const double angle = (a.angle_deg + share * (b.angle_deg - a.angle_deg)) * M_PI / 180;
  return {rotation_from_vector(angle * normalized(axis)), pivot_m,
          a.displacement_m + share * (b.displacement_m - a.displacement_m)};
}

}  // namespace tactus
