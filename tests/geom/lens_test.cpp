#include "tactus/geom/camera/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "support/message_of.h"

namespace tactus {
namespace {

using test::message_of;

/// A 640x480 camera 3 m before the origin.
CalibratedCamera camera_with(Lens lens) {
  CalibratedCamera c{look_at({0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 640, 480, 500), lens};
  c.camera.name = "a";
  c.camera.skew_px = 2;
  return c;
}

std::vector<Lens> lenses() {
  return {make_lens(LensModel::none, {}),
          make_lens(LensModel::brown, std::vector{-0.28, 0.07}),
          make_lens(LensModel::brown, std::vector{0.18, -0.256, 3e-3, 2e-3, 0.124}),
          make_lens(LensModel::brown, std::vector{0.5, -0.3, 1e-3, -1e-3, 0.02, 0.8, -0.1, 0.01}),
          make_lens(LensModel::brown, std::vector{-0.2, 0.05, 1e-3, 1e-3, 0.0, 0.0, 0.0, 0.0, 1e-3, -2e-3,
                                                  2e-3, 1e-3, 0.01, -0.02}),
          make_lens(LensModel::fisheye, std::vector{0.05, -0.01, 3e-3, -1e-3}),
          make_lens(LensModel::omni, std::vector{-0.05, 0.02, 1e-3, -5e-4, 1.2}),
          make_lens(LensModel::eucm, std::vector{0.62, 1.1}),
          make_lens(LensModel::double_sphere, std::vector{-0.21, 0.59}),
          make_lens(LensModel::double_sphere, std::vector{0.3, 0.4})};
}

TEST(Lens, UndistortInvertsDistort) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> side(-0.6, 0.6);
  for (const Lens& lens : lenses()) {
    for (int i = 0; i < 1000; ++i) {
      const Vec2d ideal{side(random), side(random)};
      const auto back = lens.undistort(lens.distort(ideal));
      ASSERT_TRUE(back.has_value());
      // Newton stops where the image is met to 1e-12; the lenses' slopes here are above 0.3.
      EXPECT_NEAR(back->x, ideal.x, 5e-12);
      EXPECT_NEAR(back->y, ideal.y, 5e-12);
    }
  }
}

/// Printed by OpenCV 4.6 (cv::projectPoints and cv::fisheye::projectPoints, K = I, identity pose) for (0.3,
/// -0.2, 1).
TEST(Lens, ModelsAreOpenCvs) {
  const Vec2d expected[] = {{0.30606380839999997, -0.20347920559999999},
                            {0.28804224851874705, -0.19198483234583139},
                            {0.29394752836234866, -0.19531691932482612},
                            {0.28961253637248846, -0.19307502424832568}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec2d seen = lenses()[i + 2].distort({0.3, -0.2});
    EXPECT_NEAR(seen.x, expected[i].x, 1e-15) << i;  // some roundings of numbers below 1
    EXPECT_NEAR(seen.y, expected[i].y, 1e-15) << i;
  }
}

/// The papers' own formulas, for points to 80 degrees off the axis, over focal lengths that lens.h scales to
/// slope 1 on the axis; and back.
TEST(Lens, SphereModelsAreThoseOfTheirPapers) {
  const double xi = 1.2, alpha = 0.62, beta = 1.1, dxi = -0.21, dalpha = 0.59;
  const Lens omni = make_lens(LensModel::omni, std::vector{0.0, 0.0, 0.0, 0.0, xi}),
             eucm = make_lens(LensModel::eucm, std::vector{alpha, beta}),
             sphere = make_lens(LensModel::double_sphere, std::vector{dxi, dalpha});
  for (double degrees = 0; degrees <= 80; degrees += 5) {
    for (const double turn : {0.3, 2.0}) {
      const double a = degrees / 57.29577951308232;
      const Vec3d p = 2.5 * Vec3d{std::sin(a) * std::cos(turn), std::sin(a) * std::sin(turn), std::cos(a)};
      const double d = length(p), r2 = p.x * p.x + p.y * p.y;
      const double w_omni = p.z + xi * d,
                   w_eucm = alpha * std::sqrt(beta * r2 + p.z * p.z) + (1 - alpha) * p.z, w = dxi * d + p.z,
                   w_sphere = dalpha * std::sqrt(r2 + w * w) + (1 - dalpha) * w;
      const std::pair<const Lens*, double> all[] = {
          {&omni, (1 + xi) / w_omni}, {&eucm, 1 / w_eucm}, {&sphere, (1 + dxi) / w_sphere}};
      for (const auto& [lens, scale] : all) {
        const Vec2d ideal{p.x / p.z, p.y / p.z}, seen = lens->distort(ideal);
        // A few roundings of numbers below 6.
        EXPECT_NEAR(seen.x, scale * p.x, 1e-14) << lens_name(lens->model) << " " << degrees;
        EXPECT_NEAR(seen.y, scale * p.y, 1e-14) << lens_name(lens->model) << " " << degrees;
        const auto back = lens->undistort(seen);
        ASSERT_TRUE(back.has_value()) << lens_name(lens->model) << " " << degrees;
        // The image is met to 1e-12, and at 80 degrees its slope is about 1/70.
        EXPECT_NEAR(back->x, ideal.x, 1e-10) << lens_name(lens->model) << " " << degrees;
        EXPECT_NEAR(back->y, ideal.y, 1e-10) << lens_name(lens->model) << " " << degrees;
      }
    }
  }
  // No picture within 84 degrees ends there.
  EXPECT_TRUE(std::isinf(omni.limit()));
  EXPECT_TRUE(std::isinf(eucm.limit()));
}

TEST(Lens, FoldsWhereTheRadiusStopsGrowing) {
  // r (1 - r^2 / 3) grows up to r = 1, to the step of the search.
  EXPECT_NEAR(make_lens(LensModel::brown, std::vector{-1.0 / 3, 0.0}).limit(), 1, 1.0 / 512 + 1e-12);
  EXPECT_FALSE(make_lens(LensModel::brown, std::vector{-1.0 / 3, 0.0}).undistort({0.7, 0.0}).has_value());
  EXPECT_TRUE(std::isinf(make_lens(LensModel::brown, std::vector{0.1, 0.0}).limit()));
  EXPECT_TRUE(std::isinf(make_lens(LensModel::fisheye, std::vector{0.0, 0.0, 0.0, 0.0}).limit()));
}

TEST(Lens, ProjectionThroughIt) {
  const CalibratedCamera c = camera_with(lenses()[2]);
  const Vec3d p{0.4, 0.3, 0.2};
  const Pixel ideal = project(c.camera, p), seen = project(c, p);
  const auto by_map = photo_pixel(c, c.camera, {ideal.u_px, ideal.v_px}, c.lens.limit());
  ASSERT_TRUE(by_map.has_value());
  EXPECT_NEAR(by_map->x, seen.u_px, 1e-9);
  EXPECT_NEAR(by_map->y, seen.v_px, 1e-9);
  EXPECT_GT(std::hypot(ideal.u_px - seen.u_px, ideal.v_px - seen.v_px), 0.1);
}

/// Every pixel of the pinhole's picture has its photo behind it, and each border has a reason to be where it
/// is.
TEST(UndistortedCamera, IsFilledByThePhoto) {
  for (const Lens& lens : lenses()) {
    const CalibratedCamera c = camera_with(lens);
    const Camera to = undistorted_camera(c);
    const double limit = lens.limit();
    const auto filled = [&](Index x, Index y) {
      const auto at = photo_pixel(c, to, {static_cast<double>(x), static_cast<double>(y)}, limit);
      return at && at->x >= -0.5 && at->y >= -0.5 && at->x <= 639.5 && at->y <= 479.5;
    };
    for (Index y = 0; y < to.height_px; ++y) {
      for (Index x = 0; x < to.width_px; ++x) ASSERT_TRUE(filled(x, y)) << x << "," << y;
    }
    EXPECT_EQ(to.T_cam_world.t, c.camera.T_cam_world.t);
  }
  // Barrel lenses (k1 < 0) need no cut, pincushion lenses do; it moves the principal point along.
  EXPECT_EQ(undistorted_camera(camera_with(lenses()[1])).width_px, 640);
  const Camera cut = undistorted_camera(camera_with(lenses()[2]));
  EXPECT_LT(cut.width_px, 640);
  EXPECT_GT(cut.width_px, 580);
  EXPECT_LT(cut.cx_px, 319.5);
}

TEST(Lens, WrongCoefficientsAreNamed) {
  EXPECT_EQ(message_of([] { make_lens(LensModel::brown, std::vector(3, 0.0)); }),
            "a lens 'brown' with 3 coefficients, expected 2, 4, 5, 8, 12 or 14 (k1 k2 p1 p2 k3 ...)");
  EXPECT_EQ(message_of([] { make_lens(LensModel::fisheye, std::vector(5, 0.0)); }),
            "a lens 'fisheye' with 5 coefficients, expected 4 (k1 k2 k3 k4)");
  EXPECT_EQ(message_of([] { make_lens(LensModel::eucm, std::vector(4, 0.0)); }),
            "a lens 'eucm' with 4 coefficients, expected 2 (alpha beta)");
  EXPECT_EQ(message_of([] {
              make_lens(LensModel::double_sphere, std::vector{-1.5, 0.5});
            }),
            "xi of the lens is -1.5, expected above -1");
  EXPECT_EQ(message_of([] {
              make_lens(LensModel::brown, std::vector{0.0, std::nan("")});
            }),
            "coefficient 2 of the lens is not a finite number");
  EXPECT_EQ(coefficients(make_lens(LensModel::brown, std::vector{0.1, 0.2})).size(), 4U);
  EXPECT_EQ(coefficients(lenses()[4]).size(), 14U);
}

}  // namespace
}  // namespace tactus
