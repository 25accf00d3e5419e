#include "tactus/rig/synthetic/figure_tracer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/masks.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

using test::make_mask;

BitMask traced_mask(const FigureTracer& tracer, const FigureShape& shape, const Camera& camera) {
  BitMask mask(camera.width_px, camera.height_px);
  for (Index s = 0; s < tracer.strip_count(); ++s) tracer.trace_strip(shape, s, &mask, nullptr);
  return mask;
}

DepthImage traced_depth(const FigureTracer& tracer, const FigureShape& shape, const Camera& camera) {
  DepthImage depth(camera.width_px, camera.height_px);
  for (Index s = 0; s < tracer.strip_count(); ++s) tracer.trace_strip(shape, s, nullptr, &depth);
  return depth;
}

/// |angle between ray and centre| against the half-angle of the cone that touches the sphere, as a signed
/// distance in pixels at the contour (positive: the ray misses).
struct SphereRay {
  double outside_px, first_hit_m;
};
SphereRay sphere_ray(const Camera& camera, Vec3d center_m, double radius_m, double u_px, double v_px) {
  const Vec3d d = pixel_ray_world(camera, u_px, v_px), c = center_m - camera.center_world();
  const double along = dot(c, d), across = length(c - along * d);
  const double angle = std::atan2(across, along) - std::asin(radius_m / length(c));
  const double in_root = radius_m * radius_m - across * across;
  return {angle * camera.fx_px, in_root > 0 ? along - std::sqrt(in_root) : 0.0};
}

TEST(FigureTracer, SphereIsTheClosedForm) {
  const Rig rig = make_synthetic_rig();
  const FigureShape shape = make_figure("sphere", {.offset_m = {0.07F, -0.1F, 0.04F}}).at(0);
  const Vec3d center{static_cast<double>(0.07F), static_cast<double>(-0.1F + 0.5F),
                     static_cast<double>(0.04F)};
  int close = 0;
  for (const Camera& camera : rig.cameras) {
    const BitMask mask = traced_mask(FigureTracer(camera), shape, camera);
    for (Index y = 0; y < camera.height_px; ++y) {
      for (Index x = 0; x < camera.width_px; ++x) {
        const SphereRay ray = sphere_ray(camera, center, 0.25, x, y);
        // 2 um (FigureTracer::kHit_m) + rounding are less than 0.002 px here; the angle understates pixels
        // off the axis by at most 1 / cos^2 < 1.5.
        if (std::abs(ray.outside_px) < 0.01) {
          ++close;
          continue;
        }
        ASSERT_EQ(mask(x, y), ray.outside_px < 0) << camera.name << " " << x << "," << y;
      }
    }
  }
  EXPECT_LT(close, 8 * 40) << "of about 8 * 600 pixels on the contour";
}

TEST(FigureTracer, DepthOfTheSphereIsTheClosedForm) {
  const Camera camera = make_synthetic_rig().depth_cameras.front();
  const FigureShape shape = make_figure("sphere").at(0);
  const DepthImage depth = traced_depth(FigureTracer(camera), shape, camera);
  int hits = 0;
  for (Index y = 0; y < camera.height_px; ++y) {
    for (Index x = 0; x < camera.width_px; ++x) {
      const SphereRay ray = sphere_ray(camera, {0, 0.5, 0}, 0.25, x, y);
      const double z_m = static_cast<double>(depth(x, y));
      if (ray.outside_px > 0.01) {
        ASSERT_EQ(z_m, 0.0);
      }
      if (ray.outside_px > -0.01) continue;
      ++hits;
      // Where tracing ends, the distance to the surface is at most 3 kHit_m, and 1 um of rounding.
      const Vec3d p = camera.center_world() + z_m * pixel_ray_world(camera, x, y);
      ASSERT_NEAR(length(p - Vec3d{0, 0.5, 0}), 0.25, 7e-6) << x << "," << y;
      // The rest of the way along the ray: 7 um over the cosine of incidence; within 1 px of the contour it
      // is above sqrt(2 * 8 mm / 0.25 m)/2 = 0.13.
      if (ray.outside_px < -1) {
        ASSERT_NEAR(z_m, ray.first_hit_m, 7e-6 / 0.12);
      }
    }
  }
  EXPECT_GT(hits, 1000);
}

class EveryFigure : public testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(, EveryFigure, testing::ValuesIn(figure_names().begin(), figure_names().end()),
                         [](const auto& param) { return param.param; });

/// One camera of the rig, its image not a multiple of any tile.
Camera odd_camera(int i) {
  SyntheticRigOptions options;
  options.width_px = 333;
  options.height_px = 251;
  options.focal_px = 310;
  return make_synthetic_rig(options).cameras[static_cast<std::size_t>(i)];
}

TEST_P(EveryFigure, TilesFindWhatEveryRayFinds) {
  for (const bool moving : {false, true}) {
    const FigureShape shape = make_figure(GetParam(), {.moving = moving}).at(1.3);
    for (const int i : {0, 3, 6}) {
      const Camera camera = odd_camera(i);
      const FigureTracer tracer(camera);
      const BitMask brute = make_mask(camera.width_px, camera.height_px, [&](Index x, Index y) {
        return tracer.first_hit_m(shape, static_cast<float>(x), static_cast<float>(y)) > 0;
      });
      const BitMask mask = traced_mask(tracer, shape, camera);
      std::int64_t different = 0;
      for (std::size_t w = 0; w < mask.words.size(); ++w)
        different += __builtin_popcount(mask.words[w] ^ brute.words[w]);
      EXPECT_EQ(different, 0) << camera.name << (moving ? ", moving" : "");
      EXPECT_GT(mask.area_px(), 100);
    }
  }
}

TEST_P(EveryFigure, DepthTilesFindWhatEveryRayFinds) {
  const FigureShape shape = make_figure(GetParam()).at(0);
  const Camera camera = make_synthetic_rig().depth_cameras.front();
  const FigureTracer tracer(camera);
  const DepthImage depth = traced_depth(tracer, shape, camera);
  const Vec3f eye = tracer.eye_m();
  for (Index y = 0; y < camera.height_px; ++y) {
    for (Index x = 0; x < camera.width_px; ++x) {
      const float z_m = tracer.first_hit_m(shape, static_cast<float>(x), static_cast<float>(y));
      ASSERT_EQ(depth(x, y) > 0, z_m > 0) << x << "," << y;
      if (z_m <= 0) continue;
      const Vec3f p = eye + depth(x, y) * tracer.direction(static_cast<float>(x), static_cast<float>(y));
      ASSERT_LE(abs(shape.distance_m(p)), 3 * FigureTracer::kHit_m + 1e-6F);
      // Both stop within 3 kHit_m of the surface; a ray that grazes a round of radius r stays there for
      // sqrt(2 r 3 kHit_m) < 1.8 mm.
      ASSERT_NEAR(depth(x, y), z_m, 1.8e-3F);
    }
  }
}

TEST(FigureTracer, BowlShowsItsCavityToTheDepthCamera) {
  const Camera camera = make_synthetic_rig().depth_cameras.front();
  const FigureShape shape = make_figure("bowl").at(0);
  const DepthImage depth = traced_depth(FigureTracer(camera), shape, camera);
  const Pixel middle = project(camera, {0, 0.5, -0.2});
  const float z_m =
      depth(static_cast<Index>(std::lround(middle.u_px)), static_cast<Index>(std::lround(middle.v_px)));
  const Vec3d p =
      camera.center_world() +
      static_cast<double>(z_m) * pixel_ray_world(camera, std::round(middle.u_px), std::round(middle.v_px));
  EXPECT_NEAR(length(p - Vec3d{0, 0.5, 0}), 0.27, 1e-5) << "the inner wall";
  EXPECT_LT(p.z, -0.2);
}

}  // namespace
}  // namespace tactus
