#include "tactus/world/fall_watch.h"

#include <algorithm>
#include <cstdio>

#include "tactus/world/start_check.h"

namespace tactus {

FallWatch::FallWatch(std::span<const ObstacleDescription> obstacles, std::span<const Box3f> boxes_m,
                     Vec3d gravity_m_s2) {
  if (!(length(gravity_m_s2) > 0)) return;
  down_ = normalized(gravity_m_s2);
  const auto add = [&](const Box3f& box) {
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3f p{(corner & 1) != 0 ? box.max.x : box.min.x, (corner & 2) != 0 ? box.max.y : box.min.y,
                    (corner & 4) != 0 ? box.max.z : box.min.z};
      lowest_m_ = std::max(lowest_m_, dot(vec_cast<double>(p), *down_));
    }
  };
  for (const Box3f& box : boxes_m) add(box);
  for (const ObstacleDescription& obstacle : obstacles) {
    if (obstacle.kind == ObstacleKind::plane)
      planes_.push_back(inverse(obstacle.T_world_obstacle));
    else if (const std::optional<Box3f> box = box_of(obstacle))
      add(*box);
  }
}

std::string FallWatch::follow(const std::string& body, Vec3d center_m, double size_m) {
  if (!down_ || reported_.contains(body)) return "";
  const double below_m = dot(center_m, *down_) - lowest_m_;
  if (!(below_m > std::min(kSizes * size_m, kMost_m))) return "";
  // A body above a plane falls onto it, unless the plane is upright.
  for (const Rigidf& T_plane_world : planes_)
    if ((T_plane_world * vec_cast<float>(center_m)).y > 0 &&
        (T_plane_world.R * vec_cast<float>(*down_)).y < -1e-3F)
      return "";
  reported_.insert(body);
  char at[160];
  std::snprintf(at, sizeof at,
                "' falls for ever: its centre is at (%.3g, %.3g, %.3g) m, %.3g m below all there is",
                center_m.x, center_m.y, center_m.z, below_m);
  return "body '" + body + at;
}

}  // namespace tactus
