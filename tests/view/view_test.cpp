#include <gtest/gtest.h>

#include <cmath>

#include "tactus/base/error.h"
#include "tactus/geom/mesh/box_surface.h"
#include "tactus/view/edge_smoothing.h"
#include "tactus/view/gl_context.h"
#include "tactus/view/gl_objects.h"
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

/// A caller's context and framebuffer, as a window's.
class CallersTarget {
 public:
  CallersTarget(Index width_px, Index height_px) : width_px_(width_px), height_px_(height_px) {
    GLuint name = 0;
    glCreateRenderbuffers(1, &name);
    color_ = GlRenderbuffer(name);
    glNamedRenderbufferStorage(name, GL_RGBA8, width_px, height_px);
    glCreateFramebuffers(1, &name);
    framebuffer_ = GlFramebuffer(name);
    glNamedFramebufferRenderbuffer(name, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color_.get());
    glBindFramebuffer(GL_FRAMEBUFFER, name);
  }
  ColorImage read() const {
    ColorImage image(width_px_, height_px_);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.get());
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    for (Index y = 0; y < height_px_; ++y)
      glReadPixels(0, height_px_ - 1 - y, width_px_, 1, GL_RGB, GL_UNSIGNED_BYTE, &image(0, y));
    return image;
  }

 private:
  Index width_px_, height_px_;
  GlRenderbuffer color_;
  GlFramebuffer framebuffer_;
};

/// Pixels, not nearly pixels: it is the same drawing, and the copy is exact. Both ways to smooth edges.
TEST_F(Picture, CallersFramebufferGetsTheSamePixels) {
  const GlContext context;
  for (const int samples : {0, 4}) {
    RendererOptions options = small();
    options.samples = samples;
    const ColorImage expected = Renderer(options).render(red_sphere(), camera());
    const GlContext::Current current(context);
    options.in_current_context = true;
    options.width_px = 100;
    Renderer renderer(options);
    renderer.resize(kWidth, kHeight);
    const CallersTarget target(kWidth, kHeight);
    renderer.draw(red_sphere(), camera());
    EXPECT_EQ(different_px(target.read(), expected), 0) << samples << " samples";
  }
}

/// The ball's front is 0.8 - 0.1 m from the eye; a pixel beside the middle sees it by 1e-4 m farther.
TEST_F(Picture, DepthUnderAPixel) {
  Renderer renderer(small());
  renderer.render(red_sphere(), camera());
  EXPECT_NEAR(renderer.depth_m(kWidth / 2, kHeight / 2), 0.7F, 2e-3F);
  EXPECT_GT(renderer.depth_m(2, 2), 1.F);
}

TEST_F(Picture, LabelsOfACallersPictureAreData) {
  const GlContext context;
  const GlContext::Current current(context);
  RendererOptions options = small();
  options.in_current_context = true;
  Renderer renderer(options);
  const CallersTarget target(kWidth, kHeight);
  ViewScene scene = red_sphere();
  scene.labels.push_back({{0, 0.25F, 0}, "above"});
  scene.labels.push_back({{0, 0.1F, -0.2F}, "hidden by the ball"});
  renderer.draw(scene, camera());
  ASSERT_EQ(renderer.labels().size(), 1U);
  EXPECT_EQ(renderer.labels()[0].text, "above");
  EXPECT_LT(renderer.labels()[0].y_px, kHeight / 2);
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

/// How much darker light makes each pixel; the ground is at y = 0.
struct Shade {
  Shade(const ViewScene& scene, const ViewCamera& view, RendererOptions options) {
    Renderer with(options);
    options.shadow_map_px = 0;
    options.ambient_occlusion = false;
    Renderer without(options);
    const ColorImage dark = with.render(scene, view), light = without.render(scene, view);
    for (std::size_t i = 0; i < dark.pixels.size(); ++i) {
      const Rgb8 a = dark.pixels[i], b = light.pixels[i];
      level.push_back(b.r + b.g + b.b - a.r - a.g - a.b);
    }
  }
  int at(Index x, Index y) const { return level[static_cast<std::size_t>(y * kWidth + x)]; }
  std::vector<int> level;
};

/// A ball hangs half a metre above the ground, under a light that is straight above it.
TEST_F(Picture, ShadowOfWhatHangsIsRoundAndEndsSoftly) {
  ViewScene scene;
  scene.meshes.push_back({"ball", test::sphere({0, 0.5F, 0}, 0.06F, 40), {}});
  scene.sun = {0, 1, 0};
  const ViewCamera view{
      .target_m = {0, 0, 0}, .distance_m = 0.9F, .azimuth_rad = 0.3F, .elevation_rad = 0.3F};
  const Shade shade(scene, view, small());
  const Rigidf T = inverse(view.T_cam_world());
  const float tangent = std::tan(0.5F * view.fov_rad);
  double sum = 0, xx = 0, zz = 0, xz = 0, x1 = 0, z1 = 0;
  int darkest = 0, steepest = 0;
  for (Index y = 1; y < kHeight; ++y) {
    for (Index x = 1; x < kWidth; ++x) {
      const Vec3f ray =
          T.R * Vec3f{tangent * (2 * (static_cast<float>(x) + 0.5F) / kWidth - 1) * kWidth / kHeight,
                      tangent * (1 - 2 * (static_cast<float>(y) + 0.5F) / kHeight), -1};
      if (ray.y > -0.05F) continue;
      const float way = -T.t.y / ray.y;
      const Vec3f p = T.t + way * ray;
      if (length(p) > 0.3F) continue;
      const double weight =
          shade.at(x, y) * double{way} * double{way} * double{way};  // area of the pixel's place
      sum += weight, x1 += weight * p.x, z1 += weight * p.z;
      xx += weight * p.x * p.x, zz += weight * p.z * p.z, xz += weight * p.x * p.z;
      darkest = std::max(darkest, shade.at(x, y));
      steepest = std::max({steepest, std::abs(shade.at(x, y) - shade.at(x - 1, y)),
                           std::abs(shade.at(x, y) - shade.at(x, y - 1))});
    }
  }
  ASSERT_GT(sum, 0);
  EXPECT_GT(darkest, 90);
  // The penumbra is as wide as the ball's own radius, 0.5 m times the lamp's tangent of 0.07 on either side:
  // some eight pixels where the picture shortens it most. A sharp edge would be a step of all of it.
  EXPECT_LE(steepest, darkest / 4);
  x1 /= sum, z1 /= sum, xx = xx / sum - x1 * x1, zz = zz / sum - z1 * z1, xz = xz / sum - x1 * z1;
  EXPECT_NEAR(x1, 0, 0.005);
  EXPECT_NEAR(z1, 0, 0.005);
  EXPECT_NEAR(xx / zz, 1, 0.1);
  EXPECT_NEAR(xz / zz, 0, 0.05);
}

/// A close-up of the middle of a bar, which hangs half a metre above the ground: its shadow goes on beside
/// what is near. At x = 0.3 m, 5 cm from its end, no penumbra of 0.5 m times the lamp's tangent of 0.07
/// begins yet.
TEST_F(Picture, CloseUpsHaveWholeShadows) {
  ViewScene scene;
  TriangleMesh bar = box_surface({0.35F, 0.02F, 0.02F}, Vec3i{1, 1, 1});
  for (Vec3f& p : bar.positions_m) p.y += 0.5F;
  scene.meshes.push_back({"bar", bar, {}});
  scene.sun = {0, 0.5F, 0.22F};
  const ViewCamera view{
      .target_m = {0, 0.5F, 0}, .distance_m = 0.3F, .azimuth_rad = 0, .elevation_rad = 0.9F};
  const Shade shade(scene, view, small());
  const auto at = [&](float x_m) {
    const Vec3f p = view.T_cam_world() * Vec3f{x_m, 0, -0.22F};
    const float focal_px = 0.5F * kHeight / std::tan(0.5F * view.fov_rad);
    return shade.at(static_cast<Index>(kWidth / 2 - focal_px * p.x / p.z),
                    static_cast<Index>(kHeight / 2 + focal_px * p.y / p.z));
  };
  EXPECT_GT(at(0), 30);
  EXPECT_NEAR(at(0.3F), at(0), 0.2 * at(0));
  EXPECT_NEAR(at(-0.3F), at(0), 0.2 * at(0));
}

/// The ground is darkened near a body alone, not over a square of a map.
TEST_F(Picture, GroundFarFromAShadowIsOpen) {
  ViewScene scene;
  scene.meshes.push_back({"ball", test::sphere({0, 0.5F, 0}, 0.05F, 40), {}});
  const ViewCamera view{.target_m = {0, 0.3F, 0}, .distance_m = 1.2F, .elevation_rad = 0.6F};
  const Shade shade(scene, view, small());
  // The shadow falls to the right and away from the sun; the left third of the picture is ground without any.
  for (Index y = 0; y < kHeight; ++y)
    for (Index x = 0; x < kWidth / 3; ++x) ASSERT_LE(shade.at(x, y), 3) << x << ", " << y;
}

/// A ball alone shades nothing that faces the sun by more than 30 degrees: taps around a point lie in its own
/// plane.
TEST_F(Picture, WhatFacesTheSunDoesNotShadeItself) {
  RendererOptions options = small();
  options.ambient_occlusion = false;
  Renderer with(options);
  options.shadow_map_px = 0;
  Renderer without(options);
  ViewScene scene = red_sphere();
  scene.ground = false;
  const ViewCamera view = camera();
  const ColorImage shaded = with.render(scene, view), lit = without.render(scene, view);
  const Rigidf T = inverse(view.T_cam_world());
  const float tangent = std::tan(0.5F * view.fov_rad);
  const Vec3f center{0, 0.1F, 0}, sun = normalized(scene.sun, {0, 1, 0});
  int seen = 0;
  for (Index y = 0; y < kHeight; ++y) {
    for (Index x = 0; x < kWidth; ++x) {
      const Vec3f ray = normalized(
          T.R * Vec3f{tangent * (2 * (static_cast<float>(x) + 0.5F) / kWidth - 1) * kWidth / kHeight,
                      tangent * (1 - 2 * (static_cast<float>(y) + 0.5F) / kHeight), -1},
          {0, 0, 1});
      const Vec3f to = center - T.t, off = to - dot(to, ray) * ray;
      if (length(off) > 0.097F) continue;
      const Vec3f at = -off - std::sqrt(0.01F - dot(off, off)) * ray;
      if (dot(at, sun) < 0.05F) continue;
      ++seen;
      ASSERT_EQ(shaded(x, y), lit(x, y)) << x << ", " << y;
    }
  }
  EXPECT_GT(seen, 1000);
}

/// A body's part that fell deep and far changes no shadow of the part that stayed.
TEST_F(Picture, FallenPartsLeaveShadowsAlone) {
  Renderer renderer(small());
  ViewScene scene = red_sphere();
  const ColorImage before = renderer.render(scene, camera());
  TriangleMesh& mesh = scene.meshes[0].mesh;
  const TriangleMesh part = test::sphere({9, -40, 7}, 0.1F, 10);
  const auto first = static_cast<Index>(mesh.positions_m.size());
  mesh.positions_m.insert(mesh.positions_m.end(), part.positions_m.begin(), part.positions_m.end());
  mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
  for (const auto& t : part.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  EXPECT_EQ(different_px(before, renderer.render(scene, camera())), 0);
}

/// Nor does what lies below the ground, beneath what hangs above it.
TEST_F(Picture, WhatFellThroughTheGroundHidesNoSky) {
  Renderer renderer(small());
  ViewScene scene = red_sphere();
  const ColorImage before = renderer.render(scene, camera());
  for (const Vec3f at_m : {Vec3f{0.15F, -0.3F, 0.1F}, Vec3f{0, -0.15F, 0}})
    scene.meshes.push_back({.name = "fallen", .mesh = test::sphere(at_m, 0.1F, 10)});
  EXPECT_EQ(different_px(before, renderer.render(scene, camera())), 0);
}

TEST_F(Picture, CamerasAreSeenAsSuch) {
  Renderer renderer(small());
  ViewScene scene = red_sphere();
  const ColorImage bare = renderer.render(scene, camera());
  // Beside the ball, it looks at the eye.
  Camera drawn = look_at({-0.17, 0.1, 0}, vec_cast<double>(camera().eye_m()), {0, 1, 0}, 640, 480, 600);
  drawn.name = "left";
  add_camera(scene, drawn, 0.12F);
  EXPECT_EQ(scene.lines.size(), 8U);
  ASSERT_EQ(scene.labels.size(), 1U);
  EXPECT_EQ(scene.labels[0].text, "left");
  const ColorImage shown = renderer.render(scene, camera());
  EXPECT_GT(different_px(bare, shown), 300);
  // It casts no shadow: the right half of the picture is as before.
  int dark = 0;
  for (Index y = 0; y < kHeight; ++y) {
    for (Index x = 0; x < kWidth; ++x) {
      if (x > kWidth / 2) {
        ASSERT_EQ(shown(x, y), bare(x, y));
      }
      dark += brightness(shown(x, y)) < 3 * 70 && brightness(bare(x, y)) > 3 * 120 ? 1 : 0;
    }
  }
  EXPECT_GT(dark, 20) << "its lens";
}

/// Edges of a box end behind what is in it, from wherever one looks, and behind what reaches out of it.
TEST_F(Picture, NoEdgeOfABoxCrossesABody) {
  Renderer renderer(small());
  for (const auto& [azimuth, right_m] :
       {std::pair{0.F, 0.13F}, {0.5F, 0.13F}, {2.2F, 0.13F}, {0.5F, 0.02F}}) {
    for (const float elevation : {0.15F, 0.7F}) {
      ViewScene scene = red_sphere();
      ViewCamera view = camera();
      view.azimuth_rad = azimuth;
      view.elevation_rad = elevation;
      const ColorImage bare = renderer.render(scene, view);
      scene.boxes.push_back({{{-0.13F, 0, -0.13F}, {right_m, 0.22F, 0.13F}}});
      const ColorImage boxed = renderer.render(scene, view);
      EXPECT_GT(different_px(bare, boxed), 200);
      int crossed = 0;
      const Vec3f eye = view.eye_m();
      const Rigidf T = inverse(view.T_cam_world());
      const float tangent = std::tan(0.5F * view.fov_rad);
      for (Index y = 0; y < kHeight; ++y) {
        for (Index x = 0; x < kWidth; ++x) {
          const Vec3f ray =
              T.R * Vec3f{tangent * (2 * (static_cast<float>(x) + 0.5F) / kWidth - 1) * kWidth / kHeight,
                          tangent * (1 - 2 * (static_cast<float>(y) + 0.5F) / kHeight), -1};
          const Vec3f to = Vec3f{0, 0.1F, 0} - eye, unit = normalized(ray, {0, 0, 1});
          const Vec3f off = to - dot(to, unit) * unit;
          if (length(off) < 0.097F) crossed += boxed(x, y) == bare(x, y) ? 0 : 1;  // two pixels from the rim
        }
      }
      EXPECT_EQ(crossed, 0) << azimuth << ", " << elevation;
    }
  }
  std::vector<ViewLine> lines;
  const ViewBox box{{{-1, -1, -1}, {1, 1, 1}}};
  add_far_edges(lines, box, {3, 4, 5});
  EXPECT_EQ(lines.size(), 9U) << "without the three of the nearest corner";
  lines.clear();
  add_far_edges(lines, box, {0.2F, 0.3F, 0.1F});
  EXPECT_EQ(lines.size(), 12U) << "from within";
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
