#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "reconstruct/painted_balls.h"
#include "support/device_sets.h"
#include "support/message_of.h"
#include "tactus/geom/camera/photo_choice.h"
#include "tactus/reconstruct/texture/surface_texture.h"
#include "tactus/view/renderer.h"
#include "view/meshes.h"

namespace tactus {
namespace {

using test::message_of;
using test::Stage;

constexpr Index kSide = 400;
constexpr float kVoxel_m = 1.F / 64;
constexpr Rgb8 kNobody{255, 0, 255};  // no paint is red and blue
// Corners of the meshes: 9.8 mm apart on the large ball, less than the voxel, as on a hull.
constexpr Index kRings = 80;

const Stage& one_ball() {
  static const Stage stage({{{0, 0.5, 0}, 0.25}});
  return stage;
}
/// A small ball between the large one and some of the cameras.
const Stage& two_balls() {
  static const Stage stage({{{-0.1, 0.5, 0}, 0.25}, {{0.27, 0.5, 0.25}, 0.1}});
  return stage;
}

TriangleMesh mesh_of(const Stage& stage) {
  TriangleMesh all;
  for (const test::Ball& ball : stage.balls) {
    const TriangleMesh one =
        test::sphere(vec_cast<float>(ball.center_m), static_cast<float>(ball.radius_m), kRings);
    const auto first = static_cast<Index>(all.positions_m.size());
    all.positions_m.insert(all.positions_m.end(), one.positions_m.begin(), one.positions_m.end());
    all.normals.insert(all.normals.end(), one.normals.begin(), one.normals.end());
    for (const auto& [a, b, c] : one.triangles) all.triangles.push_back({a + first, b + first, c + first});
  }
  return all;
}

std::shared_ptr<ViewPhotos> photos_of(const Stage& stage, Index k, std::vector<ColorImage> images) {
  return std::make_shared<ViewPhotos>(ViewPhotos{.cameras = stage.cameras,
                                                 .images = std::move(images),
                                                 .k = k,
                                                 .voxel_size_m = kVoxel_m,
                                                 .center_m = {0, 0.5F, 0}});
}

ViewScene scene_of(const Stage& stage, std::shared_ptr<const ViewPhotos> photos) {
  ViewScene scene;
  scene.ground = false;
  ViewMesh view{.name = "balls", .mesh = mesh_of(stage), .photos = std::move(photos)};
  view.colors.assign(view.mesh.positions_m.size(), kNobody);
  scene.meshes.push_back(std::move(view));
  return scene;
}

ViewCamera viewer(float azimuth_rad) {
  return {.target_m = {0, 0.5F, 0}, .distance_m = 2, .azimuth_rad = azimuth_rad, .elevation_rad = 0.25F};
}

/// The same as one of OpenCV's convention, for rays and projections.
Camera pinhole(const ViewCamera& view) {
  Camera camera;
  camera.width_px = camera.height_px = kSide;
  camera.fx_px = camera.fy_px = 0.5 * kSide / std::tan(0.5 * static_cast<double>(view.fov_rad));
  camera.cx_px = camera.cy_px = 0.5 * (kSide - 1);
  const Rigidf T = view.T_cam_world();
  camera.T_cam_world.R = {
      {vec_cast<double>(T.R.row[0]), -vec_cast<double>(T.R.row[1]), -vec_cast<double>(T.R.row[2])}};
  camera.T_cam_world.t = {static_cast<double>(T.t.x), -static_cast<double>(T.t.y),
                          -static_cast<double>(T.t.z)};
  return camera;
}

Vec3d as_vector(Rgb8 c) {
  return {static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b)};
}

/// The compute pass on the same mesh, for the same viewer.
std::vector<std::uint32_t> computed(const TriangleMesh& mesh, const ViewPhotos& photos, Vec3f eye_m) {
  DeviceSet set("cpu");
  ExecContext& ctx = set.context(0);
  const auto vertices = static_cast<Index>(mesh.positions_m.size());
  SurfaceTexture texture(ctx, photos.cameras,
                         {.k = photos.k,
                          .voxel_size_m = photos.voxel_size_m,
                          .center_m = photos.center_m,
                          .max_vertices = vertices,
                          .fill_steps = 0});
  std::vector<Vec3i> triangles;
  for (const auto& [a, b, c] : mesh.triangles) triangles.push_back({a, b, c});
  const Buffer<Vec3f> positions = to_device(ctx, mesh.positions_m), normals = to_device(ctx, mesh.normals);
  const Buffer<Vec3i> indices = to_device(ctx, triangles);
  texture.upload(ctx, photos.images);
  texture.shade(ctx, {positions.view(), indices.view(), positions.size(), indices.size(), {}}, normals.view(),
                eye_m);
  return to_host(ctx, texture.colors());
}

class PhotoSurface : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Renderer::why_unavailable(); !why.empty()) GTEST_SKIP() << why;
  }
  static RendererOptions plain() {
    return {.width_px = kSide, .height_px = kSide, .samples = 1, .shadow_map_px = 0};
  }
};

TEST_F(PhotoSurface, FragmentsHaveTheColourOfThePaint) {
  // Rounding of photo and picture: 1. The mesh lies up to r (1 - cos(pi / 160)) = 0.05 mm inside the ball;
  // seen at cos 0.2 by camera and viewer that is 0.5 mm along the surface, 0.14 of 70 per radius. Between
  // pixels the photo is linear, the paint at cos 0.2 curved: (2.5 mm)^2 / 8 / (r^2 cos^3) * 70 < 0.12.
  constexpr double kTolerance = 1.5;
  const Stage& stage = two_balls();
  Renderer renderer(plain());
  for (const Index k : {1, 3, 12}) {
    const ViewScene scene = scene_of(stage, photos_of(stage, k, stage.photos()));
    int checked = 0, uncovered = 0, hidden_from_best = 0;
    for (const float azimuth_rad : {0.5F, 1.1F, 1.9F}) {  // the small ball before, beside, behind
      const ColorImage image = renderer.render(scene, viewer(azimuth_rad));
      const Camera eye = pinhole(viewer(azimuth_rad));
      for (Index y = 0; y < kSide; ++y) {
        for (Index x = 0; x < kSide; ++x) {
          const Vec3d from = eye.center_world(), ray = pixel_ray_world(eye, x, y);
          const auto [t, ball] = stage.hit(from, ray);
          // The small one is seen at cos 0.2 within a pixel of its outline, where photos mix in the wall.
          if (!std::isfinite(t) || ball != 0) continue;
          const Vec3d n = normalized(from + t * ray - stage.balls[0].center_m);
          if (dot(n, ray) > -0.2) continue;  // a pixel beside the outline may show what is behind
          ++checked;
          if (image(x, y) == kNobody) {
            ++uncovered;
            continue;
          }
          const Vec3d off = as_vector(image(x, y)) - Stage::paint(0, n);
          ASSERT_LE(std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)}), kTolerance)
              << "k " << k << " azimuth " << azimuth_rad << " pixel " << x << ", " << y;
          std::size_t best = 0;
          for (std::size_t c = 0; c < stage.cameras.size(); ++c) {
            if (dot(stage.cameras[c].axis_world(), ray) > dot(stage.cameras[best].axis_world(), ray))
              best = c;
          }
          const Vec3d p = from + t * ray, camera = stage.cameras[best].center_world();
          if (stage.hit(camera, normalized(p - camera)).second == 1) ++hidden_from_best;
        }
      }
    }
    EXPECT_GT(checked, 20000);
    EXPECT_GT(hidden_from_best, 300);  // so that the test for what hides means something
    EXPECT_LT(uncovered, checked / 100) << "k " << k;
  }
}

TEST_F(PhotoSurface, ChoosesTheCamerasThatTheComputePassChooses) {
  // Camera c's photo is grey 20 (c + 1) all over. Both passes must agree where the cameras that count (the
  // best for k = 1, the best three for k = 2) all look at cos > 0.65: a camera is almost out within 2 to 3
  // texels of the outline, where maps of vertices and of triangles may differ by a texel; a point at cos 0.65
  // is (1 - sin) 103 px = 25 px, 4.5 texels away from it.
  const Stage& stage = one_ball();
  std::vector<ColorImage> greys;
  for (std::size_t c = 0; c < stage.cameras.size(); ++c) {
    const auto grey = static_cast<std::uint8_t>(20 * (c + 1));
    greys.emplace_back(640, 480, Rgb8{grey, grey, grey});
  }
  Renderer renderer(plain());
  for (const Index k : {1, 2}) {
    const auto photos = photos_of(stage, k, greys);
    const ViewScene scene = scene_of(stage, photos);
    const TriangleMesh& mesh = scene.meshes.front().mesh;
    int compared = 0;
    for (int view = 0; view < 6; ++view) {
      const ViewCamera looks = viewer(0.3F + static_cast<float>(view));
      const ColorImage image = renderer.render(scene, looks);
      const std::vector<std::uint32_t> colors = computed(mesh, *photos, looks.eye_m());
      const Camera eye = pinhole(looks);
      for (std::size_t i = 0; i < colors.size(); ++i) {
        const Vec3d p = vec_cast<double>(mesh.positions_m[i]), n = vec_cast<double>(mesh.normals[i]);
        if (dot(n, normalized(eye.center_world() - p)) < 0.4 || colors[i] == 0) continue;
        // What each camera's score is at most, and its cosine; the best first. (The pixel's fragment is up to
        // 2.4 mm / 0.4 from the vertex along the surface: 0.024 of the radius, so 0.17 may be 0.2 there.)
        std::vector<std::pair<double, double>> ranks;
        for (const Camera& c : stage.cameras) {
          const double cosine = dot(n, normalized(c.center_world() - p));
          const double turned = 1 - dot(c.axis_world(), normalized(p - eye.center_world()));
          if (cosine > 0.17) ranks.emplace_back(1 / (turned + 0.01), cosine);
        }
        std::sort(ranks.rbegin(), ranks.rend());
        bool doubt = ranks.size() < 3;
        for (std::size_t r = 0; !doubt && r < (k == 1 ? 1U : 3U); ++r) doubt = ranks[r].second < 0.65;
        // The pixel's centre is up to 0.7 px, 2.4 mm, from the vertex: 0.0014 rad as seen from the viewer,
        // and d(1 - cos θ) = sin θ dθ, at most 0.7 % of 1 - cos θ + ε.
        if (doubt || (k == 1 && ranks[0].first < 1.02 * ranks[1].first)) continue;
        const Pixel at = project(eye, p);
        const Rgb8 shown =
            image(static_cast<Index>(std::lround(at.u_px)), static_cast<Index>(std::lround(at.v_px)));
        // k = 2: weights that are wrong by 0.7 % of 240 grey levels each, against one another; rounding
        // twice.
        EXPECT_NEAR(shown.g, colors[i] >> 8 & 255U, k == 1 ? 0 : 1 + 2 * 0.007 * 240)
            << "k " << k << " vertex " << i;
        ++compared;
      }
    }
    EXPECT_GT(compared, 200) << "k " << k;
  }
}

TEST_F(PhotoSurface, ASurfaceOnADeviceLooksLikeOneOnTheHost) {
  const Stage& stage = one_ball();
  const auto photos = photos_of(stage, 3, stage.photos());
  const ViewScene scene = scene_of(stage, photos);
  const ViewMesh& host = scene.meshes.front();
  Renderer renderer(plain());
  const ColorImage expected = renderer.render(scene, viewer(0.4F));
  std::vector<Vec3i> triangles;
  for (const auto& [a, b, c] : host.mesh.triangles) triangles.push_back({a, b, c});
  std::vector<Rgb8> pixels;
  for (const ColorImage& image : photos->images)
    pixels.insert(pixels.end(), image.pixels.begin(), image.pixels.end());
  int sets = 0;
  for (const std::string& devices : test::device_sets()) {
    if (!test::why_unavailable(devices).empty()) continue;
    DeviceSet set(devices);
    ExecContext& ctx = set.context(0);
    const Buffer<Vec3f> positions = to_device(ctx, host.mesh.positions_m),
                        normals = to_device(ctx, host.mesh.normals);
    const Buffer<Vec3i> indices = to_device(ctx, triangles);
    const Buffer<Rgb8> images = to_device(ctx, pixels);
    ViewScene on_device;
    on_device.ground = false;
    on_device.meshes.push_back({.name = "balls", .colors = host.colors, .photos = photos_of(stage, 3, {})});
    on_device.meshes.front().device = DeviceSurface{.ctx = &ctx,
                                                    .positions_m = positions.view(),
                                                    .normals = normals.view(),
                                                    .triangles = indices.view(),
                                                    .box_m = bounds(host.mesh),
                                                    .photos = images.view()};
    // Twice: the second picture reuses what the first made.
    for (int frame = 0; frame < 2; ++frame)
      EXPECT_EQ(renderer.render(on_device, viewer(0.4F)).pixels, expected.pixels) << devices;
    EXPECT_FALSE(Renderer::sharing(set.device(0)).empty());
    ++sets;
  }
  EXPECT_GE(sets, 2);
}

TEST_F(PhotoSurface, ATurnedSurfaceTakesItsPhotosAlong) {
  // Turned about the vertical together with the viewer, nothing changes but the last bits: a pixel may flip
  // at outlines and where two cameras are equally good, a few per row and line; others keep their colour
  // to 1.
  const Stage& stage = two_balls();
  Renderer renderer(plain());
  constexpr float kTurn_rad = 0.9F;
  for (const Index k : {1, 3}) {
    ViewScene scene = scene_of(stage, photos_of(stage, k, stage.photos()));
    scene.background = Vec3f{0, 0, 1};
    const ColorImage expected = renderer.render(scene, viewer(1.1F));
    EXPECT_EQ(expected(0, 0), (Rgb8{0, 0, 255}));
    const float c = std::cos(kTurn_rad), s = std::sin(kTurn_rad);
    scene.meshes.front().R_world_mesh = {{{c, 0, s}, {0, 1, 0}, {-s, 0, c}}};
    const ColorImage turned = renderer.render(scene, viewer(1.1F + kTurn_rad));
    int different = 0, other_view = 0;
    const ColorImage unturned = renderer.render(scene, viewer(1.1F));
    for (std::size_t i = 0; i < expected.pixels.size(); ++i) {
      const Vec3d off = as_vector(turned.pixels[i]) - as_vector(expected.pixels[i]);
      different += std::max({std::abs(off.x), std::abs(off.y), std::abs(off.z)}) > 1 ? 1 : 0;
      other_view += unturned.pixels[i] == expected.pixels[i] ? 0 : 1;
    }
    EXPECT_LT(different, 2 * kSide) << "k " << k;
    EXPECT_GT(other_view, 10 * kSide);  // so that the turn means something
  }
}

TEST_F(PhotoSurface, ACameraThatMissedTheTickGivesNoColour) {
  const Stage& stage = one_ball();
  std::vector<ColorImage> images(stage.cameras.size());
  images[2] = ColorImage(640, 480, {10, 200, 30});
  Renderer renderer(plain());
  const ColorImage image = renderer.render(scene_of(stage, photos_of(stage, 12, images)), viewer(0.4F));
  int green = 0, nobody = 0, other = 0;
  const Camera eye = pinhole(viewer(0.4F));
  for (Index y = 0; y < kSide; ++y) {
    for (Index x = 0; x < kSide; ++x) {
      if (!std::isfinite(stage.hit(eye.center_world(), pixel_ray_world(eye, x, y)).first)) continue;
      ++(image(x, y) == Rgb8{10, 200, 30} ? green : image(x, y) == kNobody ? nobody : other);
    }
  }
  EXPECT_GT(green, 100);
  EXPECT_GT(nobody, 100);
  // Two ways of drawing an outline may differ by a pixel: 2 pi times 100 px.
  EXPECT_LT(other, 650);
}

/// Without colours of its own, it is lit from the eye: 0.62 of white where it faces it, at 60 degrees 0.42.
TEST_F(PhotoSurface, WhatNoPhotoShowsHasAShape) {
  const Stage& stage = one_ball();
  ViewScene scene = scene_of(stage, photos_of(stage, 1, std::vector<ColorImage>(stage.cameras.size())));
  scene.meshes[0].colors.clear();
  Renderer renderer(plain());
  const ColorImage image = renderer.render(scene, viewer(0));
  const Camera eye = pinhole(viewer(0));
  int brightest = 0, dark = 0;
  for (Index y = 0; y < kSide; ++y) {
    for (Index x = 0; x < kSide; ++x) {
      if (!std::isfinite(stage.hit(eye.center_world(), pixel_ray_world(eye, x, y)).first)) continue;
      brightest = std::max<int>(brightest, image(x, y).g);
      dark += image(x, y).g < 107 ? 1 : 0;
    }
  }
  EXPECT_NEAR(brightest, 0.62 * 255, 2);
  EXPECT_GT(dark, 100);
}

/// A run refills one object with the photos of every frame: the surface wears those of this frame.
TEST_F(PhotoSurface, WearsThePhotosOfEachFrame) {
  const Stage& stage = one_ball();
  Renderer renderer(plain());
  const auto photos = photos_of(stage, 1, stage.photos());
  const ViewScene scene = scene_of(stage, photos);
  static_cast<void>(renderer.render(scene, viewer(0)));
  // The ball fills the middle of the picture. Photos of one colour: rounding is all that may differ.
  for (const Rgb8 color : {Rgb8{200, 40, 20}, Rgb8{20, 40, 200}}) {
    for (std::size_t c = 0; c < photos->images.size(); ++c)
      std::fill(photos->images[c].pixels.begin(), photos->images[c].pixels.end(), color);
    const Rgb8 seen = renderer.render(scene, viewer(0))(kSide / 2, kSide / 2);
    EXPECT_NEAR(seen.r, color.r, 1);
    EXPECT_NEAR(seen.g, color.g, 1);
    EXPECT_NEAR(seen.b, color.b, 1);
  }
}

TEST_F(PhotoSurface, RefusesWhatItCannotDraw) {
  const Stage& stage = one_ball();
  Renderer renderer(plain());
  const auto message = [&](auto&& spoil) -> std::string {
    const auto photos = photos_of(stage, 2, stage.photos());
    ViewScene scene = scene_of(stage, photos);
    spoil(*photos, scene.meshes.front());
    return message_of([&] { static_cast<void>(renderer.render(scene, viewer(0))); });
  };
  EXPECT_NE(message([](ViewPhotos& p, ViewMesh&) { p.k = 13; }).find("k is 13, expected 1 to 12"),
            std::string::npos);
  EXPECT_NE(
      message([](ViewPhotos& p, ViewMesh&) { p.images[4] = ColorImage(64, 48); }).find("'cam4' has 64x48"),
      std::string::npos);
  EXPECT_NE(message([](ViewPhotos& p, ViewMesh&) { p.images.pop_back(); }).find("11 photos of 12 cameras"),
            std::string::npos);
  EXPECT_NE(message([](ViewPhotos& p, ViewMesh&) { p.voxel_size_m = 0; }).find("voxel_size_m"),
            std::string::npos);
  EXPECT_NE(message([](ViewPhotos&, ViewMesh& m) { m.mesh.normals.clear(); }).find("normals"),
            std::string::npos);
}

}  // namespace
}  // namespace tactus
