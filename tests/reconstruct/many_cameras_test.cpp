// Rigs of 33 to 64 cameras: every one of them carves, is scored and colours.
#include <gtest/gtest.h>

#include "reconstruct/painted_balls.h"
#include "reconstruct/sphere_scene.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/geom/camera/camera_bits.h"
#include "tactus/reconstruct/texture/surface_texture.h"
#include "tactus/reconstruct/texture/view_scores.h"

namespace tactus {
namespace {

using test::kCube;

struct Views {
  std::vector<Camera> cameras;
  std::vector<BitMask> masks;

  friend Views operator+(Views a, const Views& b) {
    a.cameras.insert(a.cameras.end(), b.cameras.begin(), b.cameras.end());
    a.masks.insert(a.masks.end(), b.masks.begin(), b.masks.end());
    return a;
  }
  Views first(std::size_t n) const {
    return {{cameras.begin(), cameras.begin() + static_cast<std::ptrdiff_t>(n)},
            {masks.begin(), masks.begin() + static_cast<std::ptrdiff_t>(n)}};
  }
};

Views sphere(int count) {
  const std::vector<Camera> cameras = test::ring(count, 160, 120);
  return {cameras, test::sphere_silhouettes(cameras, {0.05, 0.5, -0.03}, 0.3)};
}
/// The same cameras before an object that fills their images.
Views blind(Views views) {
  for (BitMask& m : views.masks)
    m = test::make_mask(m.width_px, m.height_px, [](Index, Index) { return true; });
  return views;
}

TriangleMesh hull_of(const Views& views, const std::string& devices, Index tolerated = 0) {
  DeviceSet set(devices, 3);
  VisualHull hull(set, views.cameras,
                  {.workspace_m = kCube, .resolution = 48, .tolerated_views = tolerated, .min_views = 0});
  hull.upload(views.masks);
  hull.reconstruct();
  EXPECT_FALSE(hull.report().overflow.has_value());
  return hull.download();
}

void expect_same(const TriangleMesh& a, const TriangleMesh& b) {
  EXPECT_GT(a.triangles.size(), 1000U);
  EXPECT_EQ(a.positions_m, b.positions_m);
  EXPECT_EQ(a.triangles, b.triangles);
}

class ManyCameras : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(ManyCameras);

/// An intersection is the same when a cone comes twice, and when cones come that hold everything.
TEST_P(ManyCameras, HullIsThatOfTheCamerasThatCarve) {
  const Views ring = sphere(32);
  const TriangleMesh expected = hull_of(ring, "cpu");
  EXPECT_TRUE(topology(expected).closed_manifold());
  expect_same(hull_of(ring + ring.first(1), GetParam()), expected);
  expect_same(hull_of(ring + ring, GetParam()), expected);
  expect_same(hull_of(blind(ring) + ring, GetParam()), expected);
  expect_same(hull_of(blind(ring).first(1) + ring, GetParam()), expected);
}

/// A camera whose mask lost its left half carves the half space that no other one does, whatever its number.
TEST_P(ManyCameras, EveryOneCarves) {
  const Views all = sphere(64);
  const double whole = volume_m3(hull_of(all, "cpu"));
  for (const std::size_t c : {31U, 32U, 63U}) {
    Views cut = all;
    for (Index y = 0; y < cut.masks[c].height_px; ++y) {
      for (Index x = 0; x < 80; ++x) cut.masks[c].clear(x, y);
    }
    // The sphere's centre lies within 6 cm of the middle plane: 1.5 * 6 / (2 * 30) = 15 % of its volume.
    EXPECT_NEAR(volume_m3(hull_of(cut, GetParam())) / whole, 0.5, 0.15) << c;
  }
}

/// k of n: what a camera carves alone stays.
TEST_P(ManyCameras, ToleratedViewsCountAllOfThem) {
  const Views ring = sphere(32);
  expect_same(hull_of(blind(ring) + ring, GetParam(), 2), hull_of(ring, "cpu", 2));
}

TEST(ManyCamerasScores, AHoleInAnyMaskIsFound) {
  Views all = sphere(64);
  test::punch(all.masks[63], 16);
  DeviceSet set("cpu");
  ViewScores scores(set.context(0), all.cameras, {.workspace_m = kCube});
  const std::vector<ViewScore> found = scores.measure(set.context(0), all.masks);
  for (std::size_t c = 0; c < 64; ++c) EXPECT_EQ(found[c].is_suspect, c == 63) << c;
}

TEST_P(ManyCameras, ColoursComeFromCamerasThatHaveAPhoto) {
  // Cameras 0 to 31 missed the tick: the colours are those of a rig of the others alone.
  const test::Stage stage({{{0.03, 0.5, -0.02}, 0.25}}, 12);
  const auto paint = [&](int missing) {
    std::vector<Camera> cameras;
    std::vector<ColorImage> photos;
    for (int i = 0; i < missing; ++i) {
      cameras.push_back(stage.cameras[static_cast<std::size_t>(i % 12)]);
      photos.emplace_back();
    }
    const std::vector<ColorImage> seen = stage.photos();
    cameras.insert(cameras.end(), stage.cameras.begin(), stage.cameras.end());
    photos.insert(photos.end(), seen.begin(), seen.end());
    DeviceSet set(GetParam(), 3);
    ExecContext& ctx = set.context(0);
    VisualHull hull(set, stage.cameras, {kCube, 32});
    const Index capacity = hull.mesh().positions_m.size();
    SurfaceNormals normals(set.device(0), capacity);
    SurfaceTexture texture(
        ctx, cameras,
        {.k = 3, .voxel_size_m = hull.voxel_size_m(), .center_m = {0, 0.5F, 0}, .max_vertices = capacity});
    hull.upload(stage.masks());
    texture.upload(ctx, photos);
    hull.reconstruct();
    normals.compute(ctx, hull.mesh(), hull.voxel_size_m());
    texture.shade(ctx, hull.mesh(), normals.view());
    std::vector<std::uint32_t> colors = to_host(ctx, texture.colors().part(0, hull.report().vertices));
    for (std::uint32_t& c : colors) c &= 0xFFFFFFU;  // without the number of the camera
    return colors;
  };
  const std::vector<std::uint32_t> expected = paint(0);
  EXPECT_GT(expected.size(), 1000U);
  EXPECT_EQ(paint(32), expected);
  EXPECT_EQ(paint(52), expected);
}

TEST(ManyCamerasLimits, MoreThan64AreRefused) {
  DeviceSet set("cpu");
  const Views many = sphere(65);
  EXPECT_NE(test::message_of([&] {
              VisualHull(set, many.cameras, {.workspace_m = kCube});
            }).find("65 cameras: the visual hull takes at most 64"),
            std::string::npos);
}

}  // namespace
}  // namespace tactus
