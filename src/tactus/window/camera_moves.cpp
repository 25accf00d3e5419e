#include "tactus/window/camera_moves.h"

#include <algorithm>
#include <cmath>

namespace tactus {
namespace {

constexpr float kSteepest_rad = 1.5F;
constexpr float kNearest_m = 1e-3F, kFarthest_m = 1e3F;

/// Metres a pixel at this depth.
float pixel_m(const ViewCamera& camera, float depth, float height_px) {
  return 2 * depth * std::tan(0.5F * camera.fov_rad) / height_px;
}

}  // namespace

void orbit(ViewCamera& camera, PicturePoint by_px, float height_px) {
  const float rad_px = kPi / height_px;
  camera.azimuth_rad = std::remainder(camera.azimuth_rad - rad_px * by_px.x, 2 * kPi);
  camera.elevation_rad = std::clamp(camera.elevation_rad + rad_px * by_px.y, -kSteepest_rad, kSteepest_rad);
}

void pan(ViewCamera& camera, PicturePoint by_px, float height_px) {
  const Mat3f R = camera.T_cam_world().R;
  const float m = pixel_m(camera, camera.distance_m, height_px);
  camera.target_m = camera.target_m - (m * by_px.x) * R.row[0] + (m * by_px.y) * R.row[1];
}

void zoom(ViewCamera& camera, float steps) {
  camera.distance_m = std::clamp(camera.distance_m * std::pow(0.9F, steps), kNearest_m, kFarthest_m);
}

std::optional<PicturePoint> project(const ViewCamera& camera, Vec3f at_m, PicturePoint size_px) {
  const Vec3f p = camera.T_cam_world() * at_m;
  if (!(p.z < 0)) return {};
  const float scale = 1 / pixel_m(camera, -p.z, size_px.y);
  return PicturePoint{0.5F * size_px.x + scale * p.x, 0.5F * size_px.y - scale * p.y};
}

Vec3f point_under(const ViewCamera& camera, PicturePoint at_px, PicturePoint size_px, float depth) {
  const float m = pixel_m(camera, depth, size_px.y);
  const Vec3f in_camera{m * (at_px.x - 0.5F * size_px.x), -m * (at_px.y - 0.5F * size_px.y), -depth};
  return inverse(camera.T_cam_world()) * in_camera;
}

float depth_m(const ViewCamera& camera, Vec3f at_m) { return -(camera.T_cam_world() * at_m).z; }

}  // namespace tactus
