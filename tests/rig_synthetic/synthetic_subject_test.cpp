#include "tactus/rig/synthetic/synthetic_subject.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "support/masks.h"
#include "tactus/base/error.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/geom/image/mask_metrics.h"
#include "tactus/geom/image/rasterize.h"
#include "tactus/geom/image/render_distance.h"
#include "tactus/geom/mesh/polygonize.h"
#include "tactus/rig/synthetic/synthetic_noise.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

using test::make_mask;

TEST(Polygonize, ABallIsClosedAndHasItsVolume) {
  const float radius = 0.25F;
  const TriangleMesh mesh = polygonize({{-0.3F, -0.3F, -0.3F}, {0.3F, 0.3F, 0.3F}}, 60,
                                       [&](Vec3f p) { return length(p) - radius; });
  const MeshTopology t = topology(mesh);
  EXPECT_TRUE(t.closed_manifold());
  EXPECT_EQ(t.euler, 2);
  // Chords of 1 cm instead of arcs lose up to (h/r)²/4 = 0.04 %, linear zeros less.
  EXPECT_NEAR(volume_m3(mesh) / (4.0 / 3 * std::acos(-1.0) * std::pow(0.25, 3)), 1, 0.002);
  for (const Vec3f p : mesh.positions_m) EXPECT_NEAR(length(p), radius, 1e-3F);
}

TEST(Polygonize, ADistanceFarOutsideIsNotAskedAndGivesTheSameMesh) {
  const Box3f box_m{{-0.3F, -0.3F, -0.3F}, {0.3F, 0.3F, 0.3F}};
  std::atomic<int> asked = 0;
  const auto shell = [&](Vec3f p) {
    ++asked;
    return abs(length(p - Vec3f{0.1F, 0, 0.02F}) - 0.1F) - 0.03F;
  };
  const TriangleMesh all = polygonize(box_m, 60, shell);
  const int of_all = asked.exchange(0);
  const TriangleMesh few = polygonize(box_m, 60, shell, 1);
  EXPECT_EQ(few.positions_m, all.positions_m);
  EXPECT_EQ(few.triangles, all.triangles);
  EXPECT_LT(asked, of_all / 2);
}

TEST(Polygonize, WhatTheBoxCutsIsClosedThere) {
  const TriangleMesh mesh = polygonize({{0, 0, 0}, {1, 0.5F, 0.25F}}, 20, [](Vec3f) { return -1.F; });
  EXPECT_TRUE(topology(mesh).closed_manifold());
  // The box and up to a cell (5 cm) around it.
  EXPECT_GT(volume_m3(mesh), 0.125);
  EXPECT_LT(volume_m3(mesh), 1.1 * 0.6 * 0.35);
  EXPECT_THROW(polygonize({}, 20, [](Vec3f) { return 1.F; }), Error);
  EXPECT_THROW(polygonize({{0, 0, 0}, {1, 1, 1}}, 0, [](Vec3f) { return 1.F; }), Error);
}

/// Two programs that know nothing of one another: rays through distances, and triangles through a z-buffer.
TEST(SyntheticSubject, FigureAndItsSurfaceLookTheSame) {
  const Rig rig = make_synthetic_rig();
  const auto subject = make_figure_subject("rabbit", false);
  const TriangleMesh surface = subject->surface(0);
  EXPECT_TRUE(topology(surface).closed_manifold());
  EXPECT_NEAR(volume_m3(surface) / subject->volume_m3(0), 1, 0.01);
  for (const std::size_t c : {std::size_t{0}, std::size_t{5}}) {
    BitMask mask;
    DepthImage traced;
    subject->see(rig.cameras[c], 0, mask, traced);
    EXPECT_GT(iou(mask, render_silhouette(surface, rig.cameras[c])), 0.99);
    const DepthImage drawn = render_distance(surface, rig.cameras[c]);
    int both = 0, near = 0;
    for (std::size_t i = 0; i < traced.pixels.size(); ++i) {
      if (!(traced.pixels[i] > 0 && drawn.pixels[i] > 0)) continue;
      ++both;
      // Cells of 6 mm: chords leave arcs of 3 cm by 0.2 mm, more where the view grazes.
      near += std::abs(traced.pixels[i] - drawn.pixels[i]) < 2e-3F ? 1 : 0;
    }
    EXPECT_GT(both, 10000);
    EXPECT_GT(near, 0.97 * both);
  }
}

TEST(SyntheticSubject, AMeshTurnsAsItsVelocitySays) {
  const auto still = make_figure_subject("hand", false);
  const auto subject = make_mesh_subject(still->surface(0), 0.5, 1);
  const Box3f box = bounds(subject->surface(0));
  EXPECT_NEAR(max(box.extent().x, max(box.extent().y, box.extent().z)), 0.5F, 1e-5F);
  const float dt = 1e-3F;
  const TriangleMesh before = subject->surface(0.3 - 1e-3), after = subject->surface(0.3 + 1e-3),
                     now = subject->surface(0.3);
  for (std::size_t i = 0; i < now.positions_m.size(); i += 97) {
    const Vec3f secant = (0.5F / dt) * (after.positions_m[i] - before.positions_m[i]);
    // Central difference: w³ r dt² / 6 = 2e-5 m/s, and float32 positions over 2 ms: 1e-7 / 2e-3 = 5e-5.
    EXPECT_LT(length(secant - subject->velocity_m_s(now.positions_m[i], 0.3)), 2e-4F);
    // Paint moves along.
    EXPECT_NEAR(subject->paint(now.positions_m[i], 0.3).g, subject->paint(after.positions_m[i], 0.301).g, 1);
  }
  EXPECT_THROW(make_mesh_subject({}, 0.5, 1), Error);
  EXPECT_THROW(make_mesh_subject(still->surface(0), 2, 1), Error);
  EXPECT_THROW(make_figure_subject("hnad", false), Error);
}

TEST(SyntheticNoise, CalibrationMovesTheMiddleByThatManyPixels) {
  const Rig rig = make_synthetic_rig();
  NoiseOptions noise;
  noise.calibration_px = 2;
  double squares = 0;
  const int count = 400;
  for (int i = 0; i < count; ++i) {
    noise.seed = static_cast<std::uint64_t>(i);
    const Camera wrong = miscalibrate(rig.cameras[3], noise, 3);
    check_camera(wrong);
    const Pixel at = project(wrong, {0, 0.5, 0}), truth = project(rig.cameras[3], {0, 0.5, 0});
    squares += std::pow(at.u_px - truth.u_px, 2) + std::pow(at.v_px - truth.v_px, 2);
  }
  // A root mean square of 2 x 400 samples has a deviation of 2 / sqrt(1600) = 0.05; four of those.
  EXPECT_NEAR(std::sqrt(squares / count), 2, 0.2);
  EXPECT_NE(project(miscalibrate(rig.cameras[3], noise, 3), {0, 0.5, 0}).u_px,
            project(miscalibrate(rig.cameras[3], noise, 4), {0, 0.5, 0}).u_px);
}

TEST(SyntheticNoise, SyncDepthAndContoursHaveTheirDeviations) {
  NoiseOptions noise;
  noise.sync_ms = 5;
  noise.depth_m = 0.003;
  noise.segmentation_px = 1.5;
  double squares = 0;
  for (int tick = 0; tick < 1000; ++tick) squares += std::pow(sync_error_s(noise, 1, tick), 2);
  EXPECT_NEAR(std::sqrt(squares / 1000), 0.005, 4 * 0.005 / std::sqrt(2000.0));
  EXPECT_EQ(sync_error_s(noise, 1, 7), sync_error_s(noise, 1, 7));

  DepthImage depth(100, 100, 2.F);
  depth(3, 4) = 0;
  disturb_depth(depth, noise, 0, 0);
  EXPECT_EQ(depth(3, 4), 0);
  squares = 0;
  for (const float d : depth.pixels) squares += d > 0 ? std::pow(static_cast<double>(d) - 2, 2) : 0;
  // 3 mm at 1 m is 12 mm at 2 m.
  EXPECT_NEAR(std::sqrt(squares / 9999), 0.012, 4 * 0.012 / std::sqrt(2e4));

  // A straight contour at y = 200: where it lies now, column by column.
  BitMask mask = make_mask(4096, 400, [](Index, Index y) { return y < 200; });
  disturb_mask(mask, noise, 0, 0);
  double sum = 0;
  squares = 0;
  for (Index x = 0; x < mask.width_px; ++x) {
    Index inside = 0;
    for (Index y = 0; y < mask.height_px; ++y) inside += mask(x, y) ? 1 : 0;
    sum += static_cast<double>(inside) - 200;
    squares += std::pow(static_cast<double>(inside) - 200, 2);
  }
  // About 4096 / 14 = 290 independent places: 1.5 / sqrt(580) = 0.06, four of those; whole pixels add 1/12 to
  // the variance (0.03 px), the slope of the field makes contours ragged (some 0.1 px).
  EXPECT_NEAR(std::sqrt(squares / mask.width_px), 1.5, 0.4);
  EXPECT_NEAR(sum / mask.width_px, 0, 0.6);

  // Half a pixel is not lost between the centres of pixels: 0.5^2 and 1/12, with 0.03 of chance.
  noise.segmentation_px = 0.5;
  mask = make_mask(4096, 400, [](Index, Index y) { return y < 200; });
  disturb_mask(mask, noise, 0, 0);
  squares = 0;
  for (Index x = 0; x < mask.width_px; ++x) {
    Index inside = 0;
    for (Index y = 0; y < mask.height_px; ++y) inside += mask(x, y) ? 1 : 0;
    squares += std::pow(static_cast<double>(inside) - 200, 2);
  }
  EXPECT_NEAR(std::sqrt(squares / mask.width_px), std::sqrt(0.25 + 1.0 / 12), 0.1);

  DepthImage wiggled(1, 1, 0.47F / 4);
  NoiseOptions wiggle;
  wiggle.wiggle_m = 0.01;
  disturb_depth(wiggled, wiggle, 0, 0);
  EXPECT_NEAR(wiggled(0, 0), 0.47F / 4 + 0.01F, 1e-6F);
  noise.depth_m = -1;
  EXPECT_THROW(check_noise(noise), Error);
}

TEST(SyntheticNoise, NoneChangesNothing) {
  const Rig rig = make_synthetic_rig();
  const NoiseOptions none;
  BitMask mask = make_mask(64, 64, [](Index x, Index y) { return x > y; });
  const BitMask before = mask;
  disturb_mask(mask, none, 0, 0);
  EXPECT_EQ(mask, before);
  EXPECT_EQ(miscalibrate(rig.cameras[0], none, 0).T_cam_world.R, rig.cameras[0].T_cam_world.R);
  EXPECT_EQ(sync_error_s(none, 0, 0), 0);
}

}  // namespace
}  // namespace tactus
