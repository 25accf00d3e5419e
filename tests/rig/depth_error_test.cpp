#include "tactus/rig/images/depth_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include "support/message_of.h"

namespace tactus {
namespace {

using test::message_of;

/// What the issue plants: wiggle of 3 cm, offset of 1 cm, 1 cm radially to the corners.
double planted_m(double u, double v, double true_m) {
  const double r2 = (std::pow((u - 319.5) / 320, 2) + std::pow((v - 287.5) / 288, 2)) / 2;
  return 0.03 * std::sin(2 * std::numbers::pi * true_m / 0.9 + 0.4) + 0.01 + 0.01 * r2;
}

/// A flat target at distances from 0.6 to 3.4 m, tilted, seen by every 7th pixel of a 640x576 image.
std::vector<DepthSample> samples_of(unsigned seed, int poses, double noise_m) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_m);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<DepthSample> samples;
  for (int pose = 0; pose < poses; ++pose) {
    const double z = 0.6 + 2.8 * (pose + uniform(random)) / poses, tilt_x = 0.5 * (uniform(random) - 0.5),
                 tilt_y = 0.5 * (uniform(random) - 0.5);
    for (int v = static_cast<int>(7 * uniform(random)); v < 576; v += 7) {
      for (int u = static_cast<int>(7 * uniform(random)); u < 640; u += 7) {
        // Ray (x, y, 1) meets the plane z = z0 + tilt_x X + tilt_y Y.
        const double x = (u - 332.8) / 504.6, y = (v - 348.8) / 504.7, at = z / (1 - tilt_x * x - tilt_y * y);
        const double true_m = at * std::sqrt(1 + x * x + y * y);
        samples.push_back({static_cast<double>(u), static_cast<double>(v),
                           true_m + planted_m(u, v, true_m) + noise(random), true_m});
      }
    }
  }
  return samples;
}

double rms_m(const std::vector<DepthSample>& samples, const DepthErrorTable* table) {
  double sum = 0;
  for (const DepthSample& s : samples) {
    const double e =
        s.measured_m - (table != nullptr ? table->error_m(s.u_px, s.v_px, s.measured_m) : 0) - s.true_m;
    sum += e * e;
  }
  return std::sqrt(sum / static_cast<double>(samples.size()));
}

/// 5 mm of noise stay; what the table leaves of 3 cm of wiggle must be below 3.3 mm: sqrt(5^2 + 3.3^2) = 6
/// mm.
TEST(DepthError, HeldOutMeasurementsAreRight) {
  const auto seen = samples_of(1, 60, 0.005), held_out = samples_of(2, 17, 0.005),
             exact = samples_of(3, 17, 0);
  const DepthErrorTable table = fit_depth_error(seen, {640, 576});
  const double before = rms_m(held_out, nullptr), after = rms_m(held_out, &table),
               bias = rms_m(exact, &table);
  std::printf("held-out RMS %.2f mm before, %.2f mm after; without noise %.2f mm\n", 1e3 * before,
              1e3 * after, 1e3 * bias);
  EXPECT_GE(before, 0.020);
  EXPECT_LE(after, 0.006);
}

TEST(DepthError, TableIsTrilinearAndReadsBack) {
  DepthErrorTable table({640, 576}, {3, 3, 5}, 1, 3);
  for (std::size_t i = 0; i < table.values().size(); ++i) {
    const double u = static_cast<double>(i % 3) / 2, v = static_cast<double>(i / 3 % 3) / 2,
                 e = static_cast<double>(i / 9) / 4;
    table.values()[i] = 0.01 * u + 0.02 * v + 0.03 * e + 0.04 * u * v * e;
  }
  const std::string file = ::testing::TempDir() + "error.json";
  write_depth_error(file, table);
  const DepthErrorTable back = read_depth_error(file);
  EXPECT_EQ(back.values(), table.values());
  // u v e is linear along each axis, so trilinear interpolation gives it exactly.
  const double u = 0.3, v = 0.8, e = 0.55;
  EXPECT_NEAR(back.error_m(639 * u, 575 * v, 1 + 2 * e), 0.01 * u + 0.02 * v + 0.03 * e + 0.04 * u * v * e,
              1e-15);
  EXPECT_EQ(back.error_m(0, 0, 0.5), back.error_m(0, 0, 1));
  std::filesystem::resize_file(file, 100);
  EXPECT_NE(message_of([&] { read_depth_error(file); }).find(file + ":"), std::string::npos);
  EXPECT_NE(message_of([] {
              fit_depth_error({}, {640, 576});
            }).find("expected at least 1000"),
            std::string::npos);
}

}  // namespace
}  // namespace tactus
