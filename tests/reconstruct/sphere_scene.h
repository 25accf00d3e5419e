#pragma once
/// Cameras around the unit cube, and what they see of a sphere.
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "support/masks.h"
#include "tactus/geom/camera/camera.h"

namespace tactus::test {

inline constexpr Box3f kCube{{-0.5F, 0, -0.5F}, {0.5F, 1, 0.5F}};

/// Cameras on two rings that look at the middle of the unit cube.
inline std::vector<Camera> ring(int count, Index width = 320, Index height = 240) {
  std::vector<Camera> cameras;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.13) / count;
    const Vec3d eye{1.7 * std::cos(angle), i % 2 == 0 ? 1.3 : 0.4, 1.7 * std::sin(angle)};
    cameras.push_back(look_at(eye, {0, 0.5, 0}, {0, 1, 0}, width, height, 0.9 * width));
    cameras.back().name = "cam" + std::to_string(i);
  }
  return cameras;
}

/// The exact silhouette of a sphere: a pixel ray hits when its distance to the centre is at most the radius.
inline BitMask sphere_silhouette(const Camera& camera, Vec3d center, double radius) {
  const Vec3d eye = camera.center_world();
  return make_mask(camera.width_px, camera.height_px, [&](Index x, Index y) {
    return length(cross(pixel_ray_world(camera, x, y), center - eye)) <= radius;
  });
}

inline std::vector<BitMask> sphere_silhouettes(const std::vector<Camera>& cameras, Vec3d center,
                                               double radius) {
  std::vector<BitMask> masks;
  for (const Camera& c : cameras) masks.push_back(sphere_silhouette(c, center, radius));
  return masks;
}

}  // namespace tactus::test
