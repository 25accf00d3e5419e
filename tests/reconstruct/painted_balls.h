#pragma once
/// Painted balls and the cameras around them: everything is known in closed form.
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "support/masks.h"
#include "tactus/geom/camera/camera.h"

namespace tactus::test {

struct Ball {
  Vec3d center_m;
  double radius_m;
};

struct Stage {
  std::vector<Ball> balls;
  std::vector<Camera> cameras;

  explicit Stage(std::vector<Ball> what, int count = 12) : balls(std::move(what)) {
    for (int i = 0; i < count; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.13) / count, height = 0.5 + 0.7 * ((i % 3) - 1);
      cameras.push_back(look_at({1.7 * std::cos(angle), height, 1.7 * std::sin(angle)}, {0, 0.5, 0},
                                {0, 1, 0}, 640, 480, 600));
      cameras.back().name = "cam" + std::to_string(i);
    }
  }

  /// Colour of ball i where its outward direction is n: ball 0 is green and blue, ball 1 red. |gradient| <=
  /// 70 per unit of n in each channel.
  static Vec3d paint(std::size_t i, Vec3d n) {
    return i == 0 ? Vec3d{0, 150 + 70 * n.y, 150 + 70 * n.x} : Vec3d{200 + 50 * n.z, 0, 0};
  }
  /// Distance of the first ball on a ray, and which; +inf: none.
  std::pair<double, std::size_t> hit(Vec3d from, Vec3d direction) const {
    std::pair<double, std::size_t> best{INFINITY, 0};
    for (std::size_t i = 0; i < balls.size(); ++i) {
      const Vec3d a = balls[i].center_m - from;
      const double along = dot(a, direction);
      const double inside = balls[i].radius_m * balls[i].radius_m - (dot(a, a) - along * along);
      if (inside >= 0 && along - std::sqrt(inside) < best.first && along > 0)
        best = {along - std::sqrt(inside), i};
    }
    return best;
  }
  /// Made once.
  const std::vector<BitMask>& masks() const {
    std::vector<BitMask>& result = masks_;
    if (!result.empty()) return result;
    for (const Camera& c : cameras) {
      result.push_back(make_mask(c.width_px, c.height_px, [&](Index x, Index y) {
        return std::isfinite(hit(c.center_world(), pixel_ray_world(c, x, y)).first);
      }));
    }
    return result;
  }
  const std::vector<ColorImage>& photos() const {
    std::vector<ColorImage>& result = photos_;
    if (!result.empty()) return result;
    for (const Camera& c : cameras) {
      ColorImage image(c.width_px, c.height_px);
      for (Index y = 0; y < c.height_px; ++y) {
        for (Index x = 0; x < c.width_px; ++x) {
          const Vec3d eye = c.center_world(), ray = pixel_ray_world(c, x, y);
          const auto [t, i] = hit(eye, ray);
          if (!std::isfinite(t)) continue;
          const Vec3d rgb = paint(i, normalized(eye + t * ray - balls[i].center_m));
          const auto byte = [](double v) { return static_cast<std::uint8_t>(std::lround(v)); };
          image(x, y) = {byte(rgb.x), byte(rgb.y), byte(rgb.z)};
        }
      }
      result.push_back(std::move(image));
    }
    return result;
  }

 private:
  mutable std::vector<BitMask> masks_;
  mutable std::vector<ColorImage> photos_;
};

}  // namespace tactus::test
