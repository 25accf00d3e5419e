#include "tactus/geom/image/rasterize.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "support/masks.h"
#include "tactus/base/error.h"
#include "tactus/geom/image/mask_metrics.h"
#include "view/meshes.h"

namespace tactus {
namespace {

using test::make_mask;

/// Pixels that are not set between the first and the last set pixel of their row.
std::int64_t holes_px(const BitMask& mask) {
  std::int64_t holes = 0;
  for (Index y = 0; y < mask.height_px; ++y) {
    Index first = mask.width_px, last = -1;
    for (Index x = 0; x < mask.width_px; ++x) {
      if (mask(x, y)) first = std::min(first, x), last = x;
    }
    for (Index x = first; x <= last; ++x) holes += mask(x, y) ? 0 : 1;
  }
  return holes;
}

TEST(Rasterize, SphereMatchesItsCone) {
  const Vec3f center{0.1F, -0.05F, 0.2F};
  const double radius = 0.3;
  const Camera camera = look_at({1.2, 0.7, -1.5}, {0, 0, 0}, {0, 1, 0}, 640, 480, 600);
  // Facets of 200 rings sag by r (1 - cos(pi / 400)) = 9.3e-6 m along each direction: less than the 3.3e-5 m
  // that 0.01 px are at the sphere, 2 m away. Rays further than that from the outline are certain.
  const double band = 0.01 * 2.0 / 600;
  const BitMask mask = render_silhouette(test::sphere(center, static_cast<float>(radius), 200), camera);
  const Vec3d to_center = vec_cast<double>(center) - camera.center_world();
  std::int64_t inside = 0;
  for (Index y = 0; y < 480; ++y) {
    for (Index x = 0; x < 640; ++x) {
      const double distance = length(cross(pixel_ray_world(camera, x, y), to_center));
      if (distance < radius) ++inside;
      if (std::abs(distance - radius) < band) continue;
      EXPECT_EQ(mask(x, y), distance < radius) << x << ' ' << y;
    }
  }
  EXPECT_GT(inside, 20000);
}

TEST(Rasterize, PixelCentresAreWholeNumbersAndEdgesBelong) {
  // f = 100 px at z = 1 m, principal point (0,0): x = 0.02..0.05 m is u = 2..5 px, give or take float
  // rounding of 1e-7 px, which the rounding to 2^-14 px removes.
  Camera camera;
  camera.width_px = 40, camera.height_px = 20;
  camera.fx_px = camera.fy_px = 100;
  TriangleMesh square;
  square.positions_m = {{.02F, .03F, 1}, {.05F, .03F, 1}, {.05F, .06F, 1}, {.02F, .06F, 1}};
  square.triangles = {{0, 1, 2}, {0, 3, 2}};  // opposite windings: both cover
  const BitMask mask = render_silhouette(square, camera);
  EXPECT_EQ(mask, make_mask(40, 20, [](Index x, Index y) { return x >= 2 && x <= 5 && y >= 3 && y <= 6; }));
}

TEST(Rasterize, BoxCoversThePixelsWhoseRaysHitIt) {
  const Vec3d low{-.2, -.1, -.3}, high{.25, .3, .1};
  const Camera camera = look_at({.8, .9, -1.1}, {0, .1, 0}, {0, 1, 0}, 320, 240, 300);
  const auto hit = [&](Index x, Index y, double grow) {
    const Vec3d o = camera.center_world(), d = pixel_ray_world(camera, x, y);
    double near = 0, far = 1e9;
    for (int k = 0; k < 3; ++k) {
      const double a = (low[k] - grow - o[k]) / d[k], b = (high[k] + grow - o[k]) / d[k];
      near = std::max(near, std::min(a, b)), far = std::min(far, std::max(a, b));
    }
    return near <= far;
  };
  const BitMask mask = render_silhouette(test::box(vec_cast<float>(low), vec_cast<float>(high)), camera);
  // Rounding to 2^-14 px is 3e-7 m at 1.6 m and f = 300; a box grown or shrunk by 1e-6 m brackets it.
  for (Index y = 0; y < 240; ++y) {
    for (Index x = 0; x < 320; ++x) {
      if (hit(x, y, -1e-6)) {
        EXPECT_TRUE(mask(x, y)) << x << ' ' << y;
      } else if (!hit(x, y, 1e-6)) {
        EXPECT_FALSE(mask(x, y)) << x << ' ' << y;
      }
    }
  }
}

TEST(Rasterize, NoCracksBetweenTriangles) {
  // A sphere's silhouette is convex: a pixel missing inside a row would be a crack. Facets from far above to
  // far below the size of a pixel, from random sides.
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (const Index rings : {5, 23, 90, 400}) {
    for (int view = 0; view < 4; ++view) {
      const Vec3d eye = 1.5 * normalized(Vec3d{normal(random), normal(random), normal(random)});
      const BitMask mask =
          render_silhouette(test::sphere({}, .3F, rings), look_at(eye, {}, {.1, 1, .2}, 320, 240, 300));
      EXPECT_GT(mask.area_px(), 9000);
      EXPECT_EQ(holes_px(mask), 0) << rings;
    }
  }
}

TEST(Rasterize, CameraInsideAndTrianglesBehind) {
  const TriangleMesh around = test::box({-1, -1, -1}, {1, 1, 1});
  const Camera inside = look_at({.1, .2, .3}, {.5, -.4, .9}, {0, 1, 0}, 200, 150, 90);
  EXPECT_EQ(render_silhouette(around, inside).area_px(), 200 * 150);  // clipped walls, without a crack
  const Camera turned_away = look_at({0, 0, 3}, {0, 0, 9}, {0, 1, 0}, 200, 150, 90);
  EXPECT_EQ(render_silhouette(around, turned_away).area_px(), 0);
}

TEST(Rasterize, PlaneThroughTheCameraEndsAtTheHorizon) {
  // A huge floor 1 m below a level camera covers exactly the rows under the horizon (v > cy = 74.5): it ends
  // 1e4 m away, 90 px * 1 m / 1e4 m = 0.009 px below the horizon.
  TriangleMesh floor;
  floor.positions_m = {{-1e4F, 0, -1e4F}, {1e4F, 0, -1e4F}, {1e4F, 0, 1e4F}, {-1e4F, 0, 1e4F}};
  floor.triangles = {{0, 1, 2}, {0, 2, 3}};
  const BitMask mask = render_silhouette(floor, look_at({0, 1, 0}, {0, 1, 1}, {0, 1, 0}, 200, 150, 90));
  EXPECT_EQ(mask, make_mask(200, 150, [](Index, Index y) { return y >= 75; }));
}

TEST(Rasterize, RefusesWhatItCannotDraw) {
  const Camera camera = look_at({0, 0, -2}, {}, {0, 1, 0}, 64, 48, 50);
  TriangleMesh mesh = test::sphere({}, .3F, 6);
  mesh.triangles[3][1] = 1000;
  EXPECT_THROW(render_silhouette(mesh, camera), Error);
  mesh = test::sphere({}, .3F, 6);
  mesh.positions_m[5].y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(render_silhouette(mesh, camera), Error);
  Camera huge = camera;
  huge.width_px = 20000;
  EXPECT_THROW(render_silhouette(test::sphere({}, .3F, 6), huge), Error);
  EXPECT_EQ(render_silhouette({}, camera).area_px(), 0);
}

TEST(MaskMetrics, CountPixels) {
  const BitMask left = make_mask(40, 10, [](Index x, Index) { return x < 20; });
  const BitMask middle = make_mask(40, 10, [](Index x, Index) { return x >= 10 && x < 40; });
  EXPECT_DOUBLE_EQ(iou(left, middle), 0.25);            // 100 of 400
  EXPECT_DOUBLE_EQ(recall(left, middle), 100.0 / 300);  // of the second
  EXPECT_DOUBLE_EQ(iou(BitMask(40, 10), BitMask(40, 10)), 1);
  EXPECT_DOUBLE_EQ(recall(left, BitMask(40, 10)), 1);
  EXPECT_THROW(iou(left, BitMask(40, 11)), Error);
}

}  // namespace
}  // namespace tactus
