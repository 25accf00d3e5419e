#include "tactus/view/view_camera.h"

#include <cmath>

#include "tactus/base/error.h"

namespace tactus {

Vec3f ViewCamera::eye_m() const {
  const float c = std::cos(elevation_rad);
  return target_m +
         distance_m * Vec3f{c * std::sin(azimuth_rad), std::sin(elevation_rad), c * std::cos(azimuth_rad)};
}

Rigidf ViewCamera::T_cam_world() const {
  const Vec3f eye = eye_m();
  const Vec3f back = normalized(eye - target_m, {0, 0, 1});
  const Vec3f right = normalized(cross(Vec3f{0, 1, 0}, back), {1, 0, 0});
  const Mat3f R{{right, cross(back, right), back}};
  return {R, -(R * eye)};
}

ViewCamera frame_box(const Box3f& box_m, float azimuth_rad, float elevation_rad, float aspect,
                     float fov_rad) {
  const Vec3f half = 0.5F * box_m.extent();
  const float radius = length(half);
  if (!std::isfinite(radius) || !std::isfinite(length(box_m.center())) || half.x < 0 || half.y < 0 ||
      half.z < 0 || radius <= 0)
    throw Error("frame_box: the box is empty or not finite, nothing to look at");
  ViewCamera camera;
  camera.target_m = box_m.center();
  camera.azimuth_rad = azimuth_rad;
  camera.elevation_rad = elevation_rad;
  camera.fov_rad = fov_rad;
  // The nearest distance at which every corner is within 95 % of the picture's half width and half height.
  const Mat3f R = camera.T_cam_world().R;
  const float tan_y = 0.95F * std::tan(0.5F * camera.fov_rad), tan_x = tan_y * aspect;
  float distance = 0;
  for (int i = 0; i < 8; ++i) {
    const Vec3f p = R * Vec3f{i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z};
    distance = max(distance, p.z + max(std::abs(p.x) / tan_x, std::abs(p.y) / tan_y));
  }
  camera.distance_m = distance;
  return camera;
}

}  // namespace tactus
