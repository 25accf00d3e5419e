#include "tactus/reconstruct/texture/surface_texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "reconstruct/painted_balls.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/reconstruct/texture/photo_atlas.h"

namespace tactus {
namespace {

using test::message_of;
using test::Stage;

constexpr Box3f kCube{{-0.5F, 0, -0.5F}, {0.5F, 1, 0.5F}};

struct Textured {
  std::vector<Vec3f> positions_m, normals;
  std::vector<std::uint32_t> colors;
  float voxel_m = 0;
};

Textured texture(const std::string& devices, const Stage& stage, Index k, std::optional<Vec3f> eye_m = {},
                 int fill_steps = 0, std::uint64_t seed = 1, const std::vector<ColorImage>& photos = {}) {
  DeviceSet set(devices, seed);
  ExecContext& ctx = set.context(0);
  VisualHull hull(set, stage.cameras, {kCube, 64});
  const Index capacity = hull.mesh().positions_m.size();
  SurfaceNormals normals(set.device(0), capacity);
  SurfaceTexture paint(ctx, stage.cameras,
                       {.k = k,
                        .voxel_size_m = hull.voxel_size_m(),
                        .center_m = {0, 0.5F, 0},
                        .max_vertices = capacity,
                        .fill_steps = fill_steps});
  for (int frame = 0; frame < 2; ++frame) {  // the second must not depend on the first
    hull.upload(stage.masks());
    paint.upload(ctx, photos.empty() ? stage.photos() : photos);
    hull.reconstruct();
    normals.compute(ctx, hull.mesh(), hull.voxel_size_m());
    paint.shade(ctx, hull.mesh(), normals.view(), eye_m);
  }
  const HullReport report = hull.report();
  return {hull.download().positions_m, to_host(ctx, normals.view().part(0, report.vertices)),
          to_host(ctx, paint.colors().part(0, report.vertices)), hull.voxel_size_m()};
}

const Stage& one_ball() {
  static const Stage stage({{{0.03, 0.5, -0.02}, 0.25}});
  return stage;
}
/// A small ball between a large one and some of the cameras.
const Stage& two_balls() {
  static const Stage stage({{{-0.1, 0.5, 0}, 0.25}, {{0.27, 0.5, 0.25}, 0.1}});
  return stage;
}

Vec3d rgb(std::uint32_t color) {
  return {static_cast<double>(color & 255U), static_cast<double>(color >> 8 & 255U),
          static_cast<double>(color >> 16 & 255U)};
}

class Texture : public ::testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { TACTUS_SKIP_WITHOUT_DEVICES(GetParam()); }
};
TACTUS_INSTANTIATE_DEVICES(Texture);

TEST_P(Texture, SameBitsAsOneCpu) {
  for (const Index k : {1, 3}) {
    const Textured expected = texture("cpu", two_balls(), k, Vec3f{2, 1, 0.3F}, 3);
    const Textured got = texture(GetParam(), two_balls(), k, Vec3f{2, 1, 0.3F}, 3, 7);
    ASSERT_GT(expected.colors.size(), 1000U);
    EXPECT_EQ(got.normals, expected.normals);
    EXPECT_EQ(got.colors, expected.colors);
  }
}

TEST(Normals, OfABallPointOutwards) {
  const Textured t = texture("cpu", one_ball(), 1);
  double squares = 0, least = 1;
  for (std::size_t i = 0; i < t.normals.size(); ++i) {
    const Vec3d n = vec_cast<double>(t.normals[i]);
    EXPECT_NEAR(length(n), 1, 1e-6);
    const double cosine =
        dot(n, normalized(vec_cast<double>(t.positions_m[i]) - one_ball().balls[0].center_m));
    least = std::min(least, cosine);
    squares += 2 * (1 - cosine);
  }
  // The hull of 12 cones is a polyhedron of curved faces that touch the ball: between two contour circles
  // 30 degrees apart its surface leans by up to about 15 degrees, half of that in the mean.
  EXPECT_GT(least, std::cos(25 * std::numbers::pi / 180));
  EXPECT_LT(std::sqrt(squares / static_cast<double>(t.normals.size())), 7.5 * std::numbers::pi / 180);
}

/// A vertex at height d above the ball, seen at an angle θ to its normal, shows the point d tan θ beside its
/// foot; sampling adds a pixel (2.9 mm at 1.75 m) over cos θ. With cos θ >= 0.2: tan θ <= 4.9. Paint changes
/// by 70 per radius in a channel. One more unit for rounding twice.
double paint_tolerance(double height_m, double radius_m) {
  return 70 / radius_m * (4.9 * height_m + 0.0029 / 0.2) + 1;
}

TEST(Texture, ColoursOfABallAreThoseOfItsPaint) {
  for (const Index k : {1, 3, 12}) {
    const Stage& stage = one_ball();
    const Textured t = texture("cpu", stage, k);
    double squares = 0, heights = 0;
    std::size_t seen = 0;
    for (std::size_t i = 0; i < t.colors.size(); ++i) {
      if (t.colors[i] == 0) continue;
      const Vec3d out = vec_cast<double>(t.positions_m[i]) - stage.balls[0].center_m;
      const double height = std::max(length(out) - stage.balls[0].radius_m, 0.0);
      const Vec3d off = rgb(t.colors[i]) - Stage::paint(0, normalized(out));
      for (int channel = 0; channel < 3; ++channel)
        ASSERT_LE(std::abs(off[channel]), paint_tolerance(height, stage.balls[0].radius_m))
            << "k " << k << " vertex " << i;
      squares += dot(off, off) / 3;
      heights += height;
      ++seen;
    }
    // Only the poles, where all cameras graze, may stay without a colour.
    EXPECT_GT(static_cast<double>(seen), 0.97 * static_cast<double>(t.colors.size()));
    // Chosen cameras look nearly along the normal: within 30 degrees in the mean, tan = 0.58.
    const double n = static_cast<double>(seen);
    EXPECT_LT(std::sqrt(squares / n), 70 / 0.25 * (2 * 0.58 * heights / n + 0.0029) + 1) << k;
  }
}

TEST(Texture, WhatIsHiddenGetsNoColourOfWhatHidesIt) {
  const Stage& stage = two_balls();
  for (const Index k : {1, 3, 12}) {
    const Textured t = texture("cpu", stage, k);
    int large = 0, hidden_from_best = 0;
    for (std::size_t i = 0; i < t.colors.size(); ++i) {
      const Vec3d p = vec_cast<double>(t.positions_m[i]);
      const Vec3d out = p - stage.balls[0].center_m;
      // The hull may stand off the balls where few cameras see between them: only what lies on the large one.
      if (t.colors[i] == 0 || std::abs(length(out) - stage.balls[0].radius_m) > t.voxel_m) continue;
      ++large;
      EXPECT_LE(rgb(t.colors[i]).x, 1) << "k " << k << ": red paint on the green ball, vertex " << i;
      // Would the camera with the best angle alone see the small ball here?
      std::size_t best = 0;
      for (std::size_t c = 0; c < stage.cameras.size(); ++c) {
        if (dot(stage.cameras[c].axis_world(), out) < dot(stage.cameras[best].axis_world(), out)) best = c;
      }
      const Vec3d eye = stage.cameras[best].center_world();
      hidden_from_best += stage.hit(eye, normalized(p - eye)).second == 1 ? 1 : 0;
    }
    EXPECT_GT(large, 2000);
    EXPECT_GT(hidden_from_best, 50);  // so that the test means something
  }
}

TEST_P(Texture, AtlasOfPhotosShowsThePaint) {
  const Stage& stage = two_balls();
  DeviceSet set(GetParam());
  ExecContext& ctx = set.context(0);
  VisualHull hull(set, stage.cameras, {kCube, 64});
  SurfaceNormals normals(set.device(0), hull.mesh().positions_m.size());
  SurfaceTexture paint(ctx, stage.cameras,
                       {.k = 3,
                        .voxel_size_m = hull.voxel_size_m(),
                        .center_m = {0, 0.5F, 0},
                        .max_vertices = hull.mesh().positions_m.size(),
                        .max_triangles = hull.mesh().triangles.size()});
  hull.upload(stage.masks());
  const std::vector<ColorImage> photos = stage.photos();
  paint.upload(ctx, photos);
  hull.reconstruct();
  normals.compute(ctx, hull.mesh(), hull.voxel_size_m());
  paint.shade(ctx, hull.mesh(), normals.view());
  paint.choose(ctx, hull.mesh(), normals.view());
  const HullReport report = hull.report();
  TriangleMesh mesh = hull.download();
  mesh.normals = to_host(ctx, normals.view().part(0, report.vertices));
  const std::vector<Index> chosen = to_host(ctx, paint.triangle_cameras().part(0, report.triangles));
  const std::vector<Rgb8> colors = to_rgb(to_host(ctx, paint.colors().part(0, report.vertices)));
  const TexturedMesh t = make_photo_atlas(mesh, chosen, colors, stage.cameras, photos);

  ASSERT_EQ(t.mesh.triangles.size(), mesh.triangles.size());
  ASSERT_EQ(t.uv.size(), t.mesh.positions_m.size());
  int cut = 0, large = 0;
  for (std::size_t i = 0; i < t.mesh.triangles.size(); ++i) {
    cut += chosen[i] >= 0 ? 1 : 0;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto v = static_cast<std::size_t>(t.mesh.triangles[i][corner]);
      EXPECT_EQ(t.mesh.positions_m[v], mesh.positions_m[static_cast<std::size_t>(mesh.triangles[i][corner])]);
      const Vec2f uv = t.uv[v];
      ASSERT_TRUE(uv.x > 0 && uv.x < 1 && uv.y > 0 && uv.y < 1);
      const Vec3d out = vec_cast<double>(t.mesh.positions_m[v]) - stage.balls[0].center_m;
      const double height = length(out) - stage.balls[0].radius_m;
      if (chosen[i] < 0 || height > static_cast<double>(hull.voxel_size_m()) || height < -1e-3) continue;
      const Rgb8 texel = t.atlas(static_cast<Index>(uv.x * static_cast<float>(t.atlas.width_px)),
                                 static_cast<Index>(uv.y * static_cast<float>(t.atlas.height_px)));
      const Vec3d off =
          Vec3d{static_cast<double>(texel.r), static_cast<double>(texel.g), static_cast<double>(texel.b)} -
          Stage::paint(0, normalized(out));
      // The nearest texel instead of a bilinear one: the pixel of the tolerance is meant for that.
      ASSERT_LE(std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)}),
                paint_tolerance(std::max(height, 0.0), stage.balls[0].radius_m))
          << "triangle " << i << " from photo " << chosen[i];
      ++large;
    }
  }
  EXPECT_GT(large, 20000);
  // Triangles whose corners no one camera sees: at the poles and where the balls hide each other.
  EXPECT_GT(cut, 0.9 * static_cast<double>(chosen.size()));
}

TEST(Texture, BlendingMovesSmoothlyWithTheViewer) {
  // The cameras' photos differ: camera c has brightness 20 (c + 1) everywhere. A viewer who moves by 0.5
  // degrees sees k = 1 jump by at least 20 somewhere, but blended best-3 change by less than that everywhere.
  const Stage& stage = one_ball();
  std::vector<ColorImage> photos;
  for (std::size_t c = 0; c < stage.cameras.size(); ++c) {
    const auto grey = static_cast<std::uint8_t>(20 * (c + 1));
    photos.emplace_back(640, 480, Rgb8{grey, grey, grey});
  }
  const auto largest_jump = [&](Index k) {
    double jump = 0;
    Textured before;
    for (int step = 0; step < 30; ++step) {
      const double angle = 0.3 + step * 0.5 * std::numbers::pi / 180;
      const Vec3f eye{static_cast<float>(2 * std::cos(angle)), 0.8F, static_cast<float>(2 * std::sin(angle))};
      Textured now = texture("cpu", stage, k, eye, 0, 1, photos);
      for (std::size_t i = 0; i < before.colors.size(); ++i) {
        if (before.colors[i] != 0 && now.colors[i] != 0)
          jump = std::max(jump, std::abs(rgb(now.colors[i]).x - rgb(before.colors[i]).x));
      }
      before = std::move(now);
    }
    return jump;
  };
  EXPECT_GE(largest_jump(1), 20);
  EXPECT_LT(largest_jump(3), 20);
}

TEST(Texture, RefusesWhatItCannotUse) {
  const Stage& stage = one_ball();
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  for (const Index k : {0, 13}) {
    EXPECT_NE(message_of([&] {
                SurfaceTexture(ctx, stage.cameras, {.k = k, .voxel_size_m = 0.01F});
              }).find("expected 1 to 12"),
              std::string::npos);
  }
  SurfaceTexture paint(ctx, stage.cameras, {.k = 2, .voxel_size_m = 0.01F, .max_vertices = 10});
  std::vector<ColorImage> photos = stage.photos();
  photos[4] = ColorImage(64, 48);
  EXPECT_NE(message_of([&] { paint.upload(ctx, photos); }).find("'cam4': the photo has 64x48"),
            std::string::npos);
  photos.pop_back();
  EXPECT_NE(message_of([&] { paint.upload(ctx, photos); }).find("11 photos for 12 cameras"),
            std::string::npos);
}

TEST(Texture, ACameraWithoutAPhotoGivesNoColour) {
  const Stage& stage = one_ball();
  std::vector<ColorImage> photos = stage.photos();
  photos[3] = {};
  const Textured t = texture("cpu", stage, 1, {}, 0, 1, photos);
  const Textured all = texture("cpu", stage, 1);
  int was_used = 0;
  for (std::size_t i = 0; i < t.colors.size(); ++i) {
    EXPECT_NE(VertexColor::from(t.colors[i]), 4U);
    was_used += VertexColor::from(all.colors[i]) == 4U ? 1 : 0;
  }
  EXPECT_GT(was_used, 50);
}

}  // namespace
}  // namespace tactus
