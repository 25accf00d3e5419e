// The picture of a liquid: where its surface is drawn, and what is seen through it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "tactus/base/error.h"
#include "tactus/view/image_files.h"
#include "tactus/view/renderer.h"
#include "view/meshes.h"

namespace tactus {
namespace {

constexpr Index kWidth = 480, kHeight = 360;
constexpr float kSpacing = 0.004F;

class LiquidPicture : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Renderer::why_unavailable(); !why.empty()) GTEST_SKIP() << why;
  }
  static RendererOptions options() { return {.width_px = kWidth, .height_px = kHeight, .samples = 1}; }

  /// With TACTUS_PICTURES=FOLDER, for people who look.
  static void keep(const ColorImage& image) {
    const char* folder = std::getenv("TACTUS_PICTURES");
    if (folder == nullptr) return;
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    write_png(std::string(folder) + "/" + name + ".png", image);
  }

  /// Particles on a lattice that a little noise disturbs, where `holds`.
  template <class F>
  static ViewLiquid particles(Vec3f low_m, Vec3i count, F&& holds) {
    ViewLiquid liquid{.spacing_m = kSpacing};
    std::uint32_t random = 1;
    const auto noise = [&] {
      random = random * 1664525U + 1013904223U;
      return 0.1F * kSpacing * (static_cast<float>(random >> 8) / (1 << 23) - 1.F);
    };
    for (Index k = 0; k < count.x * count.y * count.z; ++k) {
      const Vec3f at{static_cast<float>(k % count.x), static_cast<float>(k / count.x % count.y),
                     static_cast<float>(k / count.x / count.y)};
      const Vec3f x = low_m + kSpacing * (at + Vec3f{0.5F, 0.5F, 0.5F}) + Vec3f{noise(), noise(), noise()};
      if (holds(x)) liquid.positions_m.push_back(x);
    }
    return liquid;
  }

  /// RMS of how far the drawn surface is from the true one along its normal, over pixels whose ray meets it.
  /// @param gap_m(position, ray) signed distance along the normal; NaN: not to be counted
  template <class F>
  static double rms_m(Renderer& renderer, const ViewCamera& camera, F&& gap_m) {
    const std::vector<float> depths = renderer.depths_m();
    const Rigidf T_world_cam = inverse(camera.T_cam_world());
    const float tangent = std::tan(0.5F * camera.fov_rad);
    double sum = 0, mean = 0;
    int n = 0;
    for (Index y = 0; y < kHeight; ++y) {
      for (Index x = 0; x < kWidth; ++x) {
        const Vec3f ray{tangent * (2 * (x + 0.5F) - kWidth) / kHeight,
                        tangent * (kHeight - 2 * (y + 0.5F)) / kHeight, -1};
        const float z = depths[static_cast<std::size_t>(y * kWidth + x)];
        const float gap = gap_m(T_world_cam.R * (z * ray) + T_world_cam.t, T_world_cam.R * ray);
        if (std::isnan(gap)) continue;
        sum += static_cast<double>(gap) * static_cast<double>(gap);
        mean += static_cast<double>(gap);
        ++n;
      }
    }
    EXPECT_GT(n, 10000);
    std::printf("mean %.3f d, RMS %.3f d over %d pixels\n", mean / n / kSpacing,
                std::sqrt(sum / n) / kSpacing, n);
    return std::sqrt(sum / n);
  }
};

TEST_F(LiquidPicture, APoolIsDrawnWhereItIs) {
  // 50 x 6 x 50 particles: the surface is half a spacing above the highest, so at 6 d.
  ViewScene scene{.ground = false};
  scene.liquids.push_back(particles({-0.1F, 0, -0.1F}, {50, 6, 50}, [](Vec3f) { return true; }));
  Renderer renderer(options());
  for (const float elevation_rad : {0.4F, 0.8F, 1.2F, 1.5F}) {
    const ViewCamera camera{
        .target_m = {0, 6 * kSpacing, 0}, .distance_m = 0.4F, .elevation_rad = elevation_rad};
    keep(renderer.render(scene, camera));
    const double rms = rms_m(renderer, camera, [](Vec3f p, Vec3f) {
      return std::abs(p.x) < 0.08F && std::abs(p.z) < 0.08F && p.y > 4 * kSpacing ? p.y - 6 * kSpacing : NAN;
    });
    EXPECT_LE(rms, 0.1 * static_cast<double>(kSpacing)) << elevation_rad;
  }
}

TEST_F(LiquidPicture, ABallIsDrawnWhereItIs) {
  // Shells a spacing apart, as surface tension leaves them: the outermost lies half a spacing within.
  const float radius_m = 10 * kSpacing;
  ViewLiquid ball{.spacing_m = kSpacing};
  for (int shell = 0; shell < 10; ++shell) {
    const float r = radius_m - (static_cast<float>(shell) + 0.5F) * kSpacing;
    const int count = static_cast<int>(4 * kPi * r * r / (kSpacing * kSpacing));
    for (int k = 0; k < count; ++k) {  // evenly: Vogel's spiral
      const float y = 1 - (2 * static_cast<float>(k) + 1) / static_cast<float>(count), angle = 2.39996F * k;
      const float across = std::sqrt(1 - y * y);
      ball.positions_m.push_back(r * Vec3f{across * std::cos(angle), y, across * std::sin(angle)});
    }
  }
  ViewScene scene{.ground = false};
  scene.liquids.push_back(ball);
  const ViewCamera camera{.target_m = {0, 0, 0}, .distance_m = 0.25F, .elevation_rad = 0.3F};
  Renderer renderer(options());
  keep(renderer.render(scene, camera));
  const double rms = rms_m(renderer, camera, [&](Vec3f p, Vec3f ray) {
    // Pixels that see it at less than 60 degrees: towards the rim a ray that hardly misses has no depth.
    return length(p) < 2 * radius_m && -dot(normalized(p), normalized(ray)) > 0.5F ? length(p) - radius_m
                                                                                   : NAN;
  });
  EXPECT_LE(rms, 0.1 * static_cast<double>(kSpacing));
}

TEST_F(LiquidPicture, DeepLiquidHidesWhatThinLiquidShows) {
  // Seen from above, a white plate under a wedge of liquid: red light comes farther than green.
  ViewScene scene{.ground = false};
  scene.background = Vec3f{1, 1, 1};
  scene.liquids.push_back(
      particles({-0.1F, 0, -0.1F}, {50, 12, 50}, [](Vec3f x) { return x.y < 0.25F * (x.x + 0.1F); }));
  scene.liquids[0].absorption_1_m = {20, 100, 100};
  const ViewCamera camera{.target_m = {0, 0, 0}, .distance_m = 0.4F, .azimuth_rad = 0, .elevation_rad = 1.5F};
  Renderer renderer(options());
  const ColorImage image = renderer.render(scene, camera);
  keep(image);
  const Rgb8 thin = image(kWidth / 2 - 110, kHeight / 2), deep = image(kWidth / 2 + 110, kHeight / 2);
  EXPECT_GT(thin.r, deep.r);
  EXPECT_GT(thin.g, deep.g);
  EXPECT_GT(thin.r, thin.g + 30);
}

TEST_F(LiquidPicture, NobodySeesLiquidBehindSomethingSolid) {
  ViewScene scene{.ground = false};
  scene.meshes.push_back({"ball", test::sphere({0, 0, 0}, 0.05F, 40), {.color = {0.2F, 0.2F, 0.9F}}});
  const ViewCamera camera{.target_m = {0, 0, 0}, .distance_m = 0.4F, .elevation_rad = 0};
  Renderer renderer(options());
  const ColorImage without = renderer.render(scene, camera);
  scene.liquids.push_back(particles({-0.01F, -0.01F, -0.01F}, {5, 5, 5}, [](Vec3f) { return true; }));
  scene.liquids[0].positions_m.push_back({NAN, NAN, NAN});  // one that left
  const ColorImage with = renderer.render(scene, camera);
  EXPECT_EQ(with.pixels, without.pixels);
}

/// A jet that falls straight down, 4 spacings wide: where its particles are changes from frame to frame, what
/// is seen of it hardly does. 1 m/s at 30 frames a second is 8.3 spacings a frame.
TEST_F(LiquidPicture, ASteadyJetStandsStill) {
  std::uint32_t random = 1;
  const auto noise = [&] {
    random = random * 1664525U + 1013904223U;
    return static_cast<float>(random >> 8) / (1 << 23) - 1.F;
  };
  std::vector<Vec3f> stream;
  for (int layer = 0; layer < 120; ++layer)
    for (int i = -2; i <= 2; ++i)
      for (int k = -2; k <= 2; ++k)
        if (i * i + k * k <= 4)
          stream.push_back(kSpacing *
                           (Vec3f{static_cast<float>(i), static_cast<float>(layer), static_cast<float>(k)} +
                            0.15F * Vec3f{noise(), noise(), noise()}));
  ViewScene scene{.ground = false};
  scene.liquids.push_back({.spacing_m = kSpacing});
  const ViewCamera camera{.target_m = {0, 0.24F, 0}, .distance_m = 0.4F, .elevation_rad = 0.2F};
  Renderer renderer(options());
  ColorImage before, now;
  for (const float fallen : {0.F, 8.3F}) {
    scene.liquids[0].positions_m.clear();
    for (const Vec3f p : stream) scene.liquids[0].positions_m.push_back(p - Vec3f{0, fallen * kSpacing, 0});
    std::swap(before, now);
    renderer.render(scene, camera, now);
  }
  keep(now);
  int differ = 0, red = 0;
  for (std::size_t k = 0; k < now.pixels.size(); ++k) {
    const Rgb8 a = before.pixels[k], b = now.pixels[k];
    const int off = std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
    differ += off > 25 ? 1 : 0;  // a tenth of the scale
    red += b.r > b.g + 40 ? 1 : 0;
  }
  std::printf("%d of %d pixels of the jet differ, %zu in all\n", differ, red, now.pixels.size());
  EXPECT_GT(red, 8000);
  EXPECT_LE(differ, static_cast<int>(now.pixels.size()) / 50);
}

/// Nine particles that fall one behind the other, 3 spacings apart and 0.2 off the line, are a thread with a
/// drop at either end: liquid covers three runs of the picture's rows at most. As balls of a particle's
/// volume, 1.24 spacings wide, they'd be nine. Two that fall side by side are two drops.
TEST_F(LiquidPicture, AThinJetIsAThreadAndTwoDropsAreTwo) {
  ViewScene scene{.ground = false, .background = Vec3f{1, 1, 1}};
  scene.liquids.push_back({.spacing_m = kSpacing});
  std::vector<Vec3f>& x_m = scene.liquids[0].positions_m;
  for (int k = 0; k < 9; ++k) {
    const auto along = static_cast<float>(k - 4);
    x_m.push_back(kSpacing * Vec3f{k % 2 == 0 ? 0.2F : -0.2F, 3 * along, k % 3 == 0 ? 0.2F : -0.2F});
  }
  const ViewCamera camera{.target_m = {}, .distance_m = 0.25F, .azimuth_rad = 0, .elevation_rad = 0};
  Renderer renderer(options());
  const auto is_liquid = [](Rgb8 c) { return c.r > c.g + 40; };
  const ColorImage jet = renderer.render(scene, camera);
  keep(jet);
  int rows = 0, parts = 0;
  bool before = false;
  for (Index y = 0; y < kHeight; ++y) {
    bool any = false;
    for (Index x = 0; x < kWidth; ++x) any = any || is_liquid(jet(x, y));
    rows += any ? 1 : 0;
    parts += any && !before ? 1 : 0;
    before = any;
  }
  EXPECT_GT(rows, kHeight / 2);
  EXPECT_LE(parts, 3);

  x_m = {{-1.5F * kSpacing, 0, 0}, {1.5F * kSpacing, 0, 0}};
  const ColorImage drops = renderer.render(scene, camera);
  int runs = 0;
  for (Index x = 1; x < kWidth; ++x)
    runs += is_liquid(drops(x, kHeight / 2)) && !is_liquid(drops(x - 1, kHeight / 2)) ? 1 : 0;
  EXPECT_EQ(runs, 2);
}

/// A drop that lies past a film's edge is a flat cap: nowhere higher than 0.7 spacings, as a ball would be
/// 1.1. In the film it would be part of it (LiquidBalls.SpreadInAFilm).
TEST_F(LiquidPicture, ADropBesideAFilmIsACap) {
  ViewScene scene{.ground = false};
  ViewMesh plate{.name = "plate", .material = {.color = {0.8F, 0.5F, 0.5F}}};
  plate.film.emplace();
  for (int k = 0; k < 41 * 41; ++k) {
    plate.mesh.positions_m.push_back(
        0.5F * kSpacing * Vec3f{static_cast<float>(k % 41 - 20), 0, static_cast<float>(k / 41 - 20)});
    plate.mesh.normals.push_back({0, 1, 0});
    plate.film->film_m.push_back(1e-4F);
    plate.film->stain_m.push_back(0);
    plate.film->edge_m.push_back(-kSpacing);
  }
  for (int j = 0; j < 40; ++j)
    for (int i = 0; i < 40; ++i) {
      const Index a = 41 * j + i, b = a + 1, c = a + 41, d = c + 1;
      plate.mesh.triangles.push_back({a, c, b});
      plate.mesh.triangles.push_back({b, c, d});
    }
  scene.meshes.push_back(plate);
  scene.liquids.push_back({.positions_m = {{0, 0.5F * kSpacing, 0}}, .spacing_m = kSpacing});
  const ViewCamera camera{.target_m = {0, 0, 0}, .distance_m = 0.1F, .azimuth_rad = 0, .elevation_rad = 1.5F};
  Renderer renderer(options());
  keep(renderer.render(scene, camera));
  float highest = 0;
  int covered = 0;
  const Rigidf T_world_cam = inverse(camera.T_cam_world());
  const float tangent = std::tan(0.5F * camera.fov_rad);
  const std::vector<float> depths = renderer.depths_m();
  for (Index y = 0; y < kHeight; ++y)
    for (Index x = 0; x < kWidth; ++x) {
      const Vec3f ray{tangent * (2 * (x + 0.5F) - kWidth) / kHeight,
                      tangent * (kHeight - 2 * (y + 0.5F)) / kHeight, -1};
      const Vec3f p = T_world_cam * (depths[static_cast<std::size_t>(y * kWidth + x)] * ray);
      highest = max(highest, p.y);
      covered += p.y > 0.05F * kSpacing ? 1 : 0;
    }
  EXPECT_GT(highest, 0.3F * kSpacing);
  EXPECT_LT(highest, 0.7F * kSpacing);
  // A metre at 0.1 m is 360 / (0.1 tan(fov / 2)) pixels; the cap is 1 to 1.2 spacings in radius.
  const float spacing_px = kSpacing * 0.5F * kHeight / (0.1F * tangent);
  EXPECT_GT(static_cast<float>(covered), 2.5F * spacing_px * spacing_px);
  EXPECT_LT(static_cast<float>(covered), 4.6F * spacing_px * spacing_px);
}

/// Four strips of a pale plate seen from above: dry, past a film's edge, under 0.1 mm of blood, under 2 mm,
/// and under 0.1 mm that dried. Green light at 1500 /m comes back through 0.1 mm by e^(-0.3), through 2 mm by
/// e^(-6); red at 160 /m by e^(-0.03) and e^(-0.64). Colours are the middles of strips, and what the film
/// reflects is 2 %.
TEST_F(LiquidPicture, FilmDarkensAndReddensWhatItLiesOn) {
  ViewScene scene{.ground = false};
  ViewMesh plate{.name = "plate", .material = {.color = {0.8F, 0.7F, 0.65F}, .specular = 0}};
  plate.film.emplace();
  constexpr float kThick_m[][2] = {{-1e-4F, 0}, {1e-4F, 0}, {2e-3F, 0}, {0, 1e-4F}};
  for (Index k = 0; k < 4; ++k) {
    const float x = 0.04F * static_cast<float>(k - 2);
    const auto first = static_cast<Index>(plate.mesh.positions_m.size());
    for (const Vec3f at :
         {Vec3f{x, 0, -0.1F}, Vec3f{x + 0.04F, 0, -0.1F}, Vec3f{x, 0, 0.1F}, Vec3f{x + 0.04F, 0, 0.1F}}) {
      plate.mesh.positions_m.push_back(at);
      plate.mesh.normals.push_back({0, 1, 0});
      plate.film->film_m.push_back(kThick_m[k][0]);
      plate.film->stain_m.push_back(kThick_m[k][1]);
    }
    plate.mesh.triangles.push_back({first, first + 2, first + 1});
    plate.mesh.triangles.push_back({first + 1, first + 2, first + 3});
  }
  scene.meshes.push_back(plate);
  const ViewCamera camera{.target_m = {0, 0, 0}, .distance_m = 0.4F, .azimuth_rad = 0, .elevation_rad = 1.5F};
  Renderer renderer(options());
  const ColorImage image = renderer.render(scene, camera);
  keep(image);
  // A strip of 4 cm is 0.04 / (2 * 0.4 tan(20 degrees)) of the height: 49 pixels.
  const auto colour = [&](int k) { return image(kWidth / 2 + 49 * k - 73, kHeight / 2); };
  const Rgb8 dry = colour(0), thin = colour(1), thick = colour(2), stained = colour(3);
  EXPECT_GT(dry.g, 100);
  EXPECT_LT(thin.g + 8, dry.g);
  EXPECT_LT(thick.g + 40, thin.g);
  EXPECT_LT(dry.r - thin.r, dry.g - thin.g) << "red goes through";
  EXPECT_GT(thick.r, 2 * thick.g);
  EXPECT_LT(stained.r + 10, thin.r) << "what dried is darker";
  EXPECT_LT(stained.g + 10, thin.g);
  ViewScene bare = scene;
  bare.meshes[0].film.reset();
  const Rgb8 plain = renderer.render(bare, camera)(kWidth / 2 - 73, kHeight / 2);
  EXPECT_EQ(plain.r, dry.r);
  EXPECT_EQ(plain.g, dry.g);
  scene.meshes[0].film->stain_m.pop_back();
  EXPECT_THROW(renderer.render(scene, camera), Error);
}

}  // namespace
}  // namespace tactus
