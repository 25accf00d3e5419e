#include "tactus/sim/blade.h"

#include <algorithm>
#include <cmath>

namespace tactus {

std::vector<Vec3f> blade_edge_m(const BladeDescription& blade, double time_s) {
  const auto& path = blade.path;
  std::size_t k = 1;
  while (k + 1 < path.size() && path[k].time_s < time_s) ++k;
  const MotionKeyDescription &a = path[k - 1], &b = path[k];
  const double share = std::clamp((time_s - a.time_s) / (b.time_s - a.time_s), 0.0, 1.0);
  const Vec3d moved_m = a.displacement_m + share * (b.displacement_m - a.displacement_m);
  const double angle = (a.angle_deg + share * (b.angle_deg - a.angle_deg)) * M_PI / 180;
  const Vec3d axis = normalized(blade.axis), pivot_m = blade.pivot_m.value_or(blade.from_m);
  std::vector<Vec3f> edge_m;
  for (const Vec3d end_m : {blade.from_m, blade.to_m}) {
    // Rodrigues' formula.
    const Vec3d d = end_m - pivot_m;
    const Vec3d turned =
        std::cos(angle) * d + std::sin(angle) * cross(axis, d) + (1 - std::cos(angle)) * dot(axis, d) * axis;
    edge_m.push_back(vec_cast<float>(pivot_m + turned + moved_m));
  }
  return edge_m;
}

cut::BladeStrip swept(const BladeDescription& blade, double from_s, double to_s, int frame) {
  const double begin_s = std::max(from_s, blade.path.front().time_s),
               end_s = std::min(to_s, blade.path.back().time_s);
  if (!(end_s > begin_s)) return {};
  return {blade_edge_m(blade, begin_s), blade_edge_m(blade, end_s), frame};
}

}  // namespace tactus
