#include "tactus/rig/sources/kinect.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "support/data_folder.h"
#include "support/message_of.h"
#include "tactus/base/error.h"

namespace tactus {
namespace {

using test::message_of;

/// The folder of the capture; empty without the data.
std::string capture() {
  const std::string folder = data_folder() + "/azure_kinect_tof";
  return std::filesystem::is_directory(folder) ? folder : "";
}

#define SKIP_WITHOUT_CAPTURE() \
  if (capture().empty()) GTEST_SKIP() << without_data("azure_kinect_tof")

/// Fraction of a pinhole image's distorted position, written down again: Brown-Conrady with a rational radial
/// part.
Vec2<double> distort(const CalibratedCamera& c, double x, double y) {
  const auto& d = c.lens.k;  // k1 k2 p1 p2 k3 k4 k5 k6
  const double r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
  const double radial = (1 + d[0] * r2 + d[1] * r4 + d[4] * r6) / (1 + d[5] * r2 + d[6] * r4 + d[7] * r6);
  return {c.camera.fx_px * (x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x)) + c.camera.cx_px,
          c.camera.fy_px * (y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y) + c.camera.cy_px};
}

TEST(Kinect, FactoryCalibrationIsThatOfTheVendorsLibrary) {
  SKIP_WITHOUT_CAPTURE();
  const KinectCalibration k = read_kinect_calibration(capture() + "/calibration.json", 1280, 720);
  // Printed by the vendor's library with two decimals.
  const auto expect = [](const Camera& c, double fx, double fy, double cx, double cy) {
    EXPECT_NEAR(c.fx_px, fx, 5.01e-3);
    EXPECT_NEAR(c.fy_px, fy, 5.01e-3);
    EXPECT_NEAR(c.cx_px, cx, 5.01e-3);
    EXPECT_NEAR(c.cy_px, cy, 5.01e-3);
  };
  expect(k.depth.camera, 504.61, 504.73, 332.78, 348.83);
  expect(k.color.camera, 611.80, 611.93, 639.30, 365.85);
  EXPECT_EQ(coefficients(k.depth.lens).size(), 8U);
  EXPECT_NEAR(length(k.color.camera.center_world() - k.depth.camera.center_world()), 0.0324, 1e-4);
}

TEST(Kinect, CaptureHoldsRadialDistanceOfUndistortedPixels) {
  SKIP_WITHOUT_CAPTURE();
  const auto source = open_kinect(capture());
  FrameSet frame;
  ASSERT_EQ(source->next(frame), NextFrame::success);
  ASSERT_EQ(source->rig().depth_cameras.size(), 1U);
  const Camera& tof = source->rig().depth_cameras[0];
  const KinectCalibration k = read_kinect_calibration(capture() + "/calibration.json", 1280, 720);
  const auto raw_mm = read_depth_png(capture() + "/depth_640x576_u16mm.png", 640, 576);
  int compared = 0;
  for (Index y = 0; y < 576; ++y) {
    for (Index x = 0; x < 640; ++x) {
      const double rx = (x - tof.cx_px) / tof.fx_px, ry = (y - tof.cy_px) / tof.fy_px;
      const Vec2<double> from = distort(k.depth, rx, ry);
      const auto u = static_cast<Index>(std::lround(from.x)), v = static_cast<Index>(std::lround(from.y));
      // OpenCV's map is float32: half-way cases may round either way.
      const bool clear =
          std::abs(std::abs(from.x - u) - 0.5) > 1e-3 && std::abs(std::abs(from.y - v) - 0.5) > 1e-3;
      if (!clear || u < 0 || v < 0 || u >= 640 || v >= 576) continue;
      const double z_m = raw_mm(u, v) * 1e-3;
      // float32: 6e-8 of up to 4 m, twice.
      ASSERT_NEAR(static_cast<double>(frame.depths_m.at(0)(x, y)), z_m * std::sqrt(1 + rx * rx + ry * ry),
                  1e-6)
          << x << "," << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 300000);
}

/// What an independent tool counted: 93.3 % of the measured pixels land in the colour image.
TEST(Kinect, DepthLandsInTheColorImage) {
  SKIP_WITHOUT_CAPTURE();
  const KinectCalibration k = read_kinect_calibration(capture() + "/calibration.json", 1280, 720);
  const auto raw_mm = read_depth_png(capture() + "/depth_640x576_u16mm.png", 640, 576);
  const Camera &tof = k.depth.camera, &color = k.color.camera;
  int measured = 0, landed = 0;
  for (Index y = 0; y < 576; ++y) {
    for (Index x = 0; x < 640; ++x) {
      if (raw_mm(x, y) == 0) continue;
      double rx = (x - tof.cx_px) / tof.fx_px, ry = (y - tof.cy_px) / tof.fy_px;
      for (int i = 0; i < 30; ++i) {  // Newton's method with the identity for the derivative
        const Vec2<double> at = distort(k.depth, rx, ry);
        rx += (x - at.x) / tof.fx_px;
        ry += (y - at.y) / tof.fy_px;
      }
      const double z_m = raw_mm(x, y) * 1e-3;
      const Vec3d p = color.T_cam_world * (inverse(tof.T_cam_world) * Vec3d{rx * z_m, ry * z_m, z_m});
      const Vec2<double> seen = distort(k.color, p.x / p.z, p.y / p.z);
      ++measured;
      landed += seen.x >= 0 && seen.y >= 0 && seen.x < 1280 && seen.y < 720 ? 1 : 0;
    }
  }
  EXPECT_NEAR(100.0 * landed / measured, 93.3, 0.051);  // one decimal was given
}

TEST(Kinect, BadFilesAreNamed) {
  const std::string path = ::testing::TempDir() + "calibration.json";
  const auto message = [&](const std::string& text, Index height_px = 720) -> std::string {
    std::ofstream(path) << text;
    return message_of([&] { read_kinect_calibration(path, 1280, height_px); });
  };
  EXPECT_EQ(message("{"), path + ": not JSON");
  EXPECT_EQ(message("{}"), path + ": no camera with the purpose CALIBRATION_CameraPurposeDepth");
  EXPECT_NE(message("{}", 960).find("1280x960 pixels; only the 16:9 modes"), std::string::npos);
  EXPECT_NE(message(R"({"CalibrationInformation":{"Cameras":[{"Purpose":"CALIBRATION_CameraPurposeDepth",
                        "Intrinsics":{"ModelParameters":[1,2]},"Rt":{}}]}})")
                .find("depth camera: expected 'ModelParameters' with 14 numbers"),
            std::string::npos);
  EXPECT_THROW(read_kinect_calibration("/no/such/calibration.json", 1280, 720), Error);
  EXPECT_THROW(open_kinect("/no/such/folder"), Error);
  EXPECT_THROW(read_depth_png("/no/such.png", 640, 576), Error);
}

}  // namespace
}  // namespace tactus
