#include <gtest/gtest.h>

#include <algorithm>

#include "sphere_scene.h"
#include "support/device_sets.h"
#include "tactus/base/error.h"
#include "tactus/reconstruct/visual_hull.h"

namespace tactus {
namespace {

using test::kCube, test::ring, test::sphere_silhouettes;

const Vec3d kCenter{0.05, 0.5, -0.02};
constexpr double kRadius_m = 0.1;  // 1/8 of the surface of what fills the box, so that 1024^3 takes a second

struct Result {
  TriangleMesh mesh;
  HullReport report;
};

Result sphere_hull(const std::string& devices, Index resolution, Index depth_px = 0) {
  DeviceSet set(devices, 5);
  const std::vector<Camera> cameras = ring(6);
  std::vector<Camera> tof;
  std::vector<DepthImage> depths_m;
  if (depth_px > 0) {
    tof = {look_at({0, 0.75, 1.6}, {0, 0.5, 0}, {0, 1, 0}, depth_px, depth_px, depth_px)};
    DepthImage& image = depths_m.emplace_back(depth_px, depth_px);
    const Vec3d to = kCenter - tof[0].center_world();
    for (Index y = 0; y < depth_px; ++y) {
      for (Index x = 0; x < depth_px; ++x) {
        const double along = dot(to, pixel_ray_world(tof[0], x, y));
        const double half2 = kRadius_m * kRadius_m - (dot(to, to) - along * along);
        image(x, y) = half2 >= 0 ? static_cast<float>(along - std::sqrt(half2)) : 0.F;
      }
    }
  }
  VisualHull hull(set, cameras, {kCube, resolution}, tof);
  hull.upload(sphere_silhouettes(cameras, kCenter, kRadius_m), depths_m);
  hull.carve();
  hull.extract();
  Result result{hull.download(), hull.report()};
  EXPECT_EQ(result.report.overflow, "");
  EXPECT_EQ(result.report.depth, "");
  return result;
}

TEST(LargeHull, SphereIsAClosedManifoldUpTo1024) {
  double volume_at_512 = 0;
  for (const Index n : {512, 1024}) {
    const Result r = sphere_hull("cpu", n);
    const MeshTopology t = topology(r.mesh);
    EXPECT_TRUE(t.closed_manifold()) << n;
    EXPECT_EQ(t.euler, 2) << n;
    const double volume = volume_m3(r.mesh);
    // Chords lose (h/r)^2/4 of the volume: 1e-4 at 512. Vertices lie on the outline of the pixels to the
    // bisection's 1/8 of a step, at steps of about a pixel: far below 1e-3 of the volume at both.
    if (n == 512) volume_at_512 = volume;
    EXPECT_NEAR(volume / volume_at_512, 1, 2e-3);
    // Cost follows the surface: active are the bricks within a shell around it, as thick as a brick's
    // diagonal and the four pixels that its outline and bilinear samples take part in (1.7 m / 288 px).
    const double pixel = 1.7 / 288 * n, shell = 8 * std::numbers::sqrt3 + 4 * pixel;
    const double area = 4 * std::numbers::pi * (kRadius_m * n) * (kRadius_m * n);
    EXPECT_LT(r.report.active_bricks, area * shell / 512) << n;
  }
}

TEST(LargeHull, DepthCorrectedSphereIsAClosedManifoldAt1024) {
  const Result plain = sphere_hull("cpu", 1024), deep = sphere_hull("cpu", 1024, 200);
  EXPECT_TRUE(topology(deep.mesh).closed_manifold());
  EXPECT_LT(volume_m3(deep.mesh), volume_m3(plain.mesh));
  const double sphere = 4.0 / 3 * std::numbers::pi * kRadius_m * kRadius_m * kRadius_m;
  // Half a pixel (1.5 m / 288 px / 2 = 2.6 mm) in the radius of 100 mm: 8 %.
  EXPECT_GT(volume_m3(deep.mesh), 0.92 * sphere);
}

class LargeHullOn : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(LargeHullOn);

TEST_P(LargeHullOn, SameBitsAsOneCpu) {
  for (const Index depth_px : {0, 100}) {
    const Result expected = sphere_hull("cpu", 512, depth_px), got = sphere_hull(GetParam(), 512, depth_px);
    ASSERT_GT(expected.mesh.triangles.size(), 50'000U);
    // Not EXPECT_EQ: a difference would be printed, all of it.
    EXPECT_TRUE(got.mesh.triangles == expected.mesh.triangles);
    EXPECT_TRUE(got.mesh.positions_m == expected.mesh.positions_m);
    EXPECT_EQ(got.report.active_bricks, expected.report.active_bricks);
  }
}

/// 4 times as much from one resolution to the next is surface, 8 times would be volume.
TEST(LargeHull, MemoryFollowsTheSurface) {
  DeviceSet set("cpu");
  const std::vector<Camera> cameras = ring(6);
  for (const bool depth : {false, true}) {
    const std::vector<Camera> tof(depth ? 1 : 0, cameras.front());
    const auto bytes_at = [&](Index n) {
      return static_cast<double>(VisualHull(set, cameras, {kCube, n}, tof).memory_bytes());
    };
    // What does not grow, masks and images, lowers the factors of the first.
    const double at_256 = bytes_at(256), at_512 = bytes_at(512), at_1024 = bytes_at(1024);
    for (const double factor : {at_512 / at_256, at_1024 / at_512}) {
      EXPECT_GT(factor, 3.5) << depth;
      // The share of what is kept of empty space, 8 bytes a tile of 8192 nodes and 4 to 8 a block of 32768,
      // is 1.3e-3 bytes a node: 1.4 MB of the 500 MB at 1024. It grows by 8: 4 (1 + 1.4/500) = 4.02.
      EXPECT_LT(factor, 4.05) << depth;
    }
    EXPECT_LT(at_1024, 700e6) << depth;
  }
}

TEST(LargeHull, WhatDoesNotFitIsRefusedWithWhatItWouldNeed) {
  DeviceSet set("cpu");
  const std::vector<Camera> cameras = ring(2);
  try {
    const VisualHull hull(set, cameras, {kCube, 100'000});
    FAIL() << "was not refused";
  } catch (const Error& e) {
    const std::string text = e.what();
    EXPECT_TRUE(text.starts_with("resolution 100000 would need ")) << text;
    EXPECT_NE(text.find("TB on cpu, which has "), std::string::npos) << text;
    EXPECT_NE(text.find("choose a lower resolution"), std::string::npos) << text;
  }
}

class Partition : public LargeHullOn {};
TACTUS_INSTANTIATE_DEVICES(Partition);

TEST_P(Partition, PartsOfLayersHaveAboutTheSameWork) {
  DeviceSet set(GetParam(), 3);
  ExecContext& ctx = set.context(0);
  // Ten layers of two tiles: nothing below and above, most in the middle.
  const std::vector<Index> per_tile{0, 0, 0, 0, 3, 9, 16, 16, 16, 0, 10, 6, 1, 2, 16, 16, 0, 0, 0, 0};
  std::vector<Index> first{0};
  for (const Index n : per_tile) first.push_back(first.back() + n);
  const HullGrid grid{{8, 4, 10}, {2, 1, 3}, {64, 32, 80}};
  const Index all = first.back(), largest_layer = 32;
  const Buffer<Index> tile_first = to_device(ctx, first);
  Buffer<PartRange> range(ctx.device(), 1);
  for (Index parts = 1; parts <= 12; ++parts) {
    Index next = 0;
    for (Index part = 0; part < parts; ++part) {
      ctx.parallel_for("partition", 1, PartitionLayers{grid, part, parts, tile_first.view(), range.view()});
      const PartRange r = to_host(ctx, range.const_view())[0];
      EXPECT_EQ(r.first, next) << part << " of " << parts;
      // A cut is at most half a layer off the exact one.
      EXPECT_LE(std::abs(r.first - all * part / parts), largest_layer / 2 + 1) << part << " of " << parts;
      EXPECT_GE(r.held, r.own);
      EXPECT_LE(r.first + r.held, all);
      // Cuts fall between layers.
      EXPECT_TRUE(std::any_of(first.begin(), first.end(), [&](Index f) { return f == r.first; }));
      next = r.first + r.own;
    }
    EXPECT_EQ(next, all) << parts;
  }
}

}  // namespace
}  // namespace tactus
