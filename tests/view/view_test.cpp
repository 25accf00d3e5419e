#include <gtest/gtest.h>

#include <cmath>

#include "tactus/base/error.h"
#include "tactus/view/edge_smoothing.h"
#include "tactus/view/renderer.h"
#include "view/meshes.h"

namespace tactus {
namespace {

constexpr Index kWidth = 320, kHeight = 180;

class Picture : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Renderer::why_unavailable(); !why.empty()) GTEST_SKIP() << why;
  }
  static RendererOptions small() {
    return {.width_px = kWidth, .height_px = kHeight, .samples = 4, .shadow_map_px = 512};
  }
  /// A red sphere of 0.1 m that touches the ground.
  static ViewScene red_sphere() {
    ViewScene scene;
    scene.meshes.push_back({"ball", test::sphere({0, 0.1F, 0}, 0.1F, 40), {.color = {0.9F, 0.1F, 0.1F}}});
    return scene;
  }
  static ViewCamera camera() {
    return {.target_m = {0, 0.1F, 0}, .distance_m = 0.8F, .azimuth_rad = 0, .elevation_rad = 0.5F};
  }
  static int brightness(Rgb8 c) { return c.r + c.g + c.b; }
  static int different_px(const ColorImage& a, const ColorImage& b) {
    int n = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) n += a.pixels[i] == b.pixels[i] ? 0 : 1;
    return n;
  }
};

TEST_F(Picture, RedSphereBeforeALightBackground) {
  Renderer renderer(small());
  const ColorImage image = renderer.render(red_sphere(), camera());
  ASSERT_EQ(image.width_px, kWidth);
  ASSERT_EQ(image.height_px, kHeight);
  const Rgb8 center = image(kWidth / 2, kHeight / 2);
  EXPECT_GT(center.r, 100);
  EXPECT_GT(center.r, 2 * center.g);
  EXPECT_GT(center.r, 2 * center.b);
  for (const Rgb8 corner : {image(0, 0), image(kWidth - 1, 0), image(0, kHeight - 1)}) {
    EXPECT_GT(brightness(corner), 3 * 150);
    EXPECT_LT(std::abs(corner.r - corner.b), 25);
  }
}

TEST_F(Picture, RowZeroIsTheTop) {
  Renderer renderer(small());
  ViewScene scene = red_sphere();
  ViewCamera below = camera();
  below.target_m.y = 0.2F;  // the camera moves up by 0.1 m: the ball sinks in the picture
  const ColorImage image = renderer.render(scene, below);
  EXPECT_GT(image(kWidth / 2, kHeight * 3 / 4).r, 2 * image(kWidth / 2, kHeight * 3 / 4).b);
  EXPECT_LT(std::abs(image(kWidth / 2, kHeight / 8).r - image(kWidth / 2, kHeight / 8).b), 25);
}

TEST_F(Picture, SunCastsAShadowOnTheGround) {
  RendererOptions options = small();
  options.ambient_occlusion = false;
  Renderer with(options);
  options.shadow_map_px = 0;
  Renderer without(options);
  ViewScene scene = red_sphere();
  scene.sun = {-1, 1, 0};  // from the left at 45 degrees: the ball's shadow is centred 0.1 m to the right
  const ViewCamera view = camera();
  const Rigidf T = view.T_cam_world();
  const Vec3f p = T * Vec3f{0.17F, 0, 0.03F};
  const float focal_px = 0.5F * kHeight / std::tan(0.5F * view.fov_rad);
  const Index x = static_cast<Index>(kWidth / 2 + focal_px * p.x / -p.z);
  const Index y = static_cast<Index>(kHeight / 2 - focal_px * p.y / -p.z);
  const ColorImage shaded = with.render(scene, view), lit = without.render(scene, view);
  EXPECT_LT(brightness(shaded(x, y)), 0.85 * brightness(lit(x, y)));
  EXPECT_EQ(shaded(5, kHeight - 5), lit(5, kHeight - 5));  // far from it nothing changes
}

TEST_F(Picture, GroundDarkensBesideABody) {
  RendererOptions options = small();
  options.shadow_map_px = 0;
  Renderer with(options);
  options.ambient_occlusion = false;
  Renderer without(options);
  const ColorImage dark = with.render(red_sphere(), camera()), open = without.render(red_sphere(), camera());
  std::int64_t darker = 0, brighter = 0;
  for (std::size_t i = 0; i < dark.pixels.size(); ++i) {
    darker += brightness(dark.pixels[i]) < brightness(open.pixels[i]) ? 1 : 0;
    brighter += brightness(dark.pixels[i]) > brightness(open.pixels[i]) + 3 ? 1 : 0;
  }
  EXPECT_GT(darker, 500);
  EXPECT_EQ(brighter, 0);
}

TEST_F(Picture, FrustaAndBoxAreVisible) {
  Renderer renderer(small());
  ViewScene scene = red_sphere();
  const ColorImage bare = renderer.render(scene, camera());
  add_frustum(scene, look_at({-0.2, 0.25, 0}, {0, 0.1, 0}, {0, 1, 0}, 640, 480, 600), 0.08F);
  EXPECT_EQ(scene.lines.size(), 8U);
  const ColorImage frustum = renderer.render(scene, camera());
  EXPECT_GT(different_px(bare, frustum), 100);
  add_box(scene, {{-0.15F, 0, -0.15F}, {0.15F, 0.25F, 0.15F}});
  EXPECT_EQ(scene.lines.size(), 8U + 12U);
  EXPECT_GT(different_px(frustum, renderer.render(scene, camera())), 200);
}

TEST_F(Picture, SameSceneSamePixelsWhateverWasDrawnBefore) {
  Renderer renderer(small());
  const ColorImage first = renderer.render(red_sphere(), camera());
  ViewScene large = red_sphere();
  large.meshes[0].mesh = test::sphere({0, 0.1F, 0}, 0.15F, 90);  // the buffers grow
  large.meshes.push_back({"box", test::box({0.1F, 0, 0}, {0.2F, 0.1F, 0.1F}), soft_material()});
  const ColorImage other = renderer.render(large, camera());
  EXPECT_GT(different_px(first, other), 1000);
  const ColorImage again = renderer.render(red_sphere(), camera());
  EXPECT_EQ(different_px(first, again), 0);
  Renderer second(small());
  EXPECT_EQ(different_px(first, second.render(red_sphere(), camera())), 0);
}

TEST_F(Picture, TranslucentLetsTheBackThrough) {
  Renderer renderer(small());
  ViewScene scene = red_sphere();
  scene.meshes.push_back({"glass", test::sphere({0, 0.1F, 0}, 0.13F, 30), {.color = {0.1F, 0.2F, 0.9F}}});
  const ColorImage covered = renderer.render(scene, camera());
  scene.meshes[1].material.opacity = 0.3F;
  const ColorImage through = renderer.render(scene, camera());
  const Rgb8 a = covered(kWidth / 2, kHeight / 2), b = through(kWidth / 2, kHeight / 2);
  EXPECT_GT(a.b, a.r);
  EXPECT_GT(b.r, b.b);
}

TEST_F(Picture, WireframeAndEmptyScene) {
  Renderer renderer(small());
  ViewScene scene = red_sphere();
  const ColorImage plain = renderer.render(scene, camera());
  scene.meshes[0].material.wireframe = 0.8F;
  EXPECT_GT(different_px(plain, renderer.render(scene, camera())), 300);
  const ColorImage empty = renderer.render({}, camera());
  EXPECT_GT(brightness(empty(kWidth / 2, kHeight / 2)), 3 * 150);
}

TEST_F(Picture, RefusesBadMeshesAndOptions) {
  Renderer renderer(small());
  ViewScene scene = red_sphere();
  scene.meshes[0].mesh.triangles[0][0] = -1;
  EXPECT_THROW(renderer.render(scene, camera()), Error);
  scene = red_sphere();
  scene.meshes[0].mesh.normals.pop_back();
  EXPECT_THROW(renderer.render(scene, camera()), Error);
  EXPECT_THROW(Renderer({.samples = 3}), Error);
  EXPECT_THROW(Renderer({.width_px = 0}), Error);
}

TEST(EdgeSmoothing, ComesCloserToTheCoverageOfAnEdge) {
  // Black above the line y = 0.3 x + 5, white below; coverage from 16 x 16 samples a pixel.
  const auto level = [](double x, double y) { return y > 0.3 * x + 5 ? 255.0 : 0.0; };
  ColorImage jagged(60, 40), smooth;
  for (Index y = 0; y < 40; ++y) {
    for (Index x = 0; x < 60; ++x) {
      const auto v = static_cast<std::uint8_t>(level(x, y));
      jagged(x, y) = {v, v, v};
    }
  }
  smooth_edges(jagged, smooth);
  double error_jagged = 0, error_smooth = 0;
  for (Index y = 1; y < 39; ++y) {
    for (Index x = 1; x < 59; ++x) {
      double exact = 0;
      for (int i = 0; i < 256; ++i) exact += level(x + (i % 16 - 7.5) / 16, y + (i / 16 - 7.5) / 16) / 256;
      error_jagged += std::abs(jagged(x, y).r - exact);
      error_smooth += std::abs(smooth(x, y).r - exact);
    }
  }
  EXPECT_LT(error_smooth, 0.6 * error_jagged);
  smooth_edges(ColorImage(7, 5, {90, 90, 90}), smooth);
  EXPECT_EQ(smooth.pixels, ColorImage(7, 5, {90, 90, 90}).pixels);
}

TEST(ViewCamera, FramesABox) {
  const Box3f box{{-0.3F, 0, -0.1F}, {0.5F, 0.4F, 0.2F}};
  for (const float azimuth : {0.F, 0.6F, 2.5F}) {
    const float aspect = 16.F / 9;
    const ViewCamera camera = frame_box(box, azimuth, 0.4F, aspect, azimuth > 0 ? 0.6F : 1.2F);
    float widest = 0;
    for (int i = 0; i < 8; ++i) {
      const Vec3f p =
          camera.T_cam_world() *
          Vec3f{i & 1 ? box.max.x : box.min.x, i & 2 ? box.max.y : box.min.y, i & 4 ? box.max.z : box.min.z};
      ASSERT_LT(p.z, 0);
      const float half = -p.z * std::tan(0.5F * camera.fov_rad);
      widest = max(widest, max(std::abs(p.x) / (half * aspect), std::abs(p.y) / half));
    }
    EXPECT_NEAR(widest, 0.95F, 1e-4F) << azimuth;  // the margin; float rounding of 1e-6 relative
  }
  EXPECT_THROW(frame_box({{1, 1, 1}, {0, 0, 0}}), Error);
}

}  // namespace
}  // namespace tactus
