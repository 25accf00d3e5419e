#include "tactus/sim/blade.h"

#include <algorithm>
#include <cmath>

#include "tactus/sim/blade_mesh.h"
#include "tactus/sim/keyframes.h"

namespace tactus {
namespace {

KeyframePose blade_pose(const BladeDescription& blade, double time_s) {
  if (blade.held) return {Mat3d::identity(), {}, {}};
  return keyframe_pose(blade.path, blade.axis, blade.pivot_m.value_or(blade.from_m), time_s);
}

/// The side that follows the edge on the longest way that it goes across itself; where nothing moves it.
Vec3d backwards(const BladeDescription& blade) {
  const Vec3d middle_m = 0.5 * (blade.from_m + blade.to_m), along = normalized(blade.to_m - blade.from_m);
  Vec3d way{};
  for (std::size_t k = 1; k < blade.path.size(); ++k) {
    const double from_s = blade.path[k - 1].time_s, to_s = blade.path[k].time_s;
    const KeyframePose half = blade_pose(blade, 0.5 * (from_s + to_s));
    const Vec3d step = blade_pose(blade, to_s)(middle_m) - blade_pose(blade, from_s)(middle_m);
    const Vec3d at_rest = transpose(half.R) * step, across = at_rest - dot(at_rest, along) * along;
    if (length(across) > length(way)) way = across;
  }
  const Vec3d other = std::abs(along.y) < 0.9 ? Vec3d{0, -1, 0} : Vec3d{0, 0, -1};
  return normalized(length(way) > 1e-9 ? -1.0 * way : -1.0 * (other - dot(other, along) * along));
}

}  // namespace

std::vector<Vec3f> blade_edge_m(const BladeDescription& blade, double time_s) {
  const KeyframePose pose = blade_pose(blade, time_s);
  return {vec_cast<float>(pose(blade.from_m)), vec_cast<float>(pose(blade.to_m))};
}

TriangleMesh blade_mesh(const BladeDescription& blade, double time_s) {
  const Vec3d along = blade.to_m - blade.from_m, back = backwards(blade);
  const Vec3d side = normalized(cross(along, back));
  const double deep_m = std::clamp(0.15 * length(along), 0.006, 0.03), half_m = 0.03 * deep_m;
  const KeyframePose pose = blade_pose(blade, time_s);
  TriangleMesh mesh;
  // Across: the edge, where the ground faces begin, and the back. No normals: its faces are flat.
  const std::pair<double, double> profile[] = {{0, 0}, {0.3, 1}, {1, 1}, {1, -1}, {0.3, -1}};
  constexpr Index kCorners = 5;
  for (const Vec3d end_m : {blade.from_m, blade.to_m}) {
    for (const auto& [deep, wide] : profile)
      mesh.positions_m.push_back(vec_cast<float>(pose(end_m + deep * deep_m * back + wide * half_m * side)));
  }
  for (Index k = 0; k < kCorners; ++k) {
    const Index next = (k + 1) % kCorners;
    mesh.triangles.push_back({k, k + kCorners, next});
    mesh.triangles.push_back({next, k + kCorners, next + kCorners});
    if (k < 2) continue;
    mesh.triangles.push_back({0, k - 1, k});
    mesh.triangles.push_back({kCorners, kCorners + k, kCorners + k - 1});
  }
  return mesh;
}

std::vector<TriangleMesh> scripted_blades(const Scene& scene, double time_s) {
  std::vector<TriangleMesh> all;
  for (const BladeDescription& blade : scene.blades) {
    if (!blade.tracked && !blade.held && time_s <= blade.path.back().time_s)
      all.push_back(blade_mesh(blade, time_s));
  }
  return all;
}

cut::BladeStrip swept(const BladeDescription& blade, double from_s, double to_s, int frame) {
  const double begin_s = std::max(from_s, blade.path.front().time_s),
               end_s = std::min(to_s, blade.path.back().time_s);
  if (!(end_s > begin_s)) return {};
  return {blade_edge_m(blade, begin_s), blade_edge_m(blade, end_s), frame};
}

}  // namespace tactus
