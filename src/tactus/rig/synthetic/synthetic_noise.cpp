#include "tactus/rig/synthetic/synthetic_noise.h"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "tactus/base/error.h"
#include "tactus/geom/image/mask_bounds.h"
#include "tactus/rig/images/silhouettes.h"

namespace tactus {
namespace {

constexpr double kCorrelation_px = 8;
constexpr double kWigglePeriod_m = 0.47;

/// A generator of its own for each kind of noise, camera and tick.
cv::RNG generator(const NoiseOptions& noise, std::uint64_t kind, int camera, std::int64_t tick) {
  std::uint64_t x = noise.seed * 0x9e3779b97f4a7c15ULL + kind;
  for (const std::uint64_t part : {static_cast<std::uint64_t>(camera), static_cast<std::uint64_t>(tick)}) {
    x = (x ^ (part + 1)) * 0xbf58476d1ce4e5b9ULL;
    x ^= x >> 29;
  }
  cv::RNG random(x | 1U);
  random.next();
  return random;
}

}  // namespace

void check_noise(const NoiseOptions& noise) {
  const auto check = [](const char* name, double value) {
    if (!(value >= 0 && value < 1e6))
      throw usage_error(std::string("noise: ") + name + " is " + std::to_string(value) +
                        ", expected 0 or more");
  };
  check("calibration [px]", noise.calibration_px);
  check("sync [ms]", noise.sync_ms);
  check("segmentation [px]", noise.segmentation_px);
  check("depth [m]", noise.depth_m);
  check("wiggle [m]", noise.wiggle_m);
}

Camera miscalibrate(const Camera& camera, const NoiseOptions& noise, int camera_number) {
  if (noise.calibration_px == 0) return camera;
  cv::RNG random = generator(noise, 1, camera_number, 0);
  // Half of the variance in each direction of the image.
  const double sigma_rad = noise.calibration_px / camera.fx_px / std::sqrt(2.0);
  const double pitch = random.gaussian(sigma_rad), yaw = random.gaussian(sigma_rad);
  const Mat3d Rx{{{1, 0, 0}, {0, std::cos(pitch), -std::sin(pitch)}, {0, std::sin(pitch), std::cos(pitch)}}};
  const Mat3d Ry{{{std::cos(yaw), 0, std::sin(yaw)}, {0, 1, 0}, {-std::sin(yaw), 0, std::cos(yaw)}}};
  Camera wrong = camera;
  wrong.T_cam_world = Rigidd{Rx * Ry, {}} * camera.T_cam_world;
  return wrong;
}

double sync_error_s(const NoiseOptions& noise, int camera_number, std::int64_t tick) {
  if (noise.sync_ms == 0) return 0;
  return generator(noise, 2, camera_number, tick).gaussian(noise.sync_ms * 1e-3);
}

void disturb_mask(BitMask& mask, const NoiseOptions& noise, int camera_number, std::int64_t tick) {
  if (noise.segmentation_px == 0) return;
  const cv::Size size(mask.width_px, mask.height_px);
  const PixelRect rect = bounds_of(mask);
  if (rect.empty()) return;
  // Nothing is moved as far as that: ten standard deviations.
  const Index reach = static_cast<Index>(std::ceil(10 * noise.segmentation_px)) + 2;
  const cv::Rect part =
      cv::Rect(rect.min_x - reach, rect.min_y - reach, rect.max_x - rect.min_x + 1 + 2 * reach,
               rect.max_y - rect.min_y + 1 + 2 * reach) &
      cv::Rect({}, size);
  cv::Mat inside(part.size(), CV_8U);
  for (Index y = 0; y < inside.rows; ++y) {
    for (Index x = 0; x < inside.cols; ++x)
      inside.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(mask(x + part.x, y + part.y) ? 255 : 0);
  }
  cv::Mat within, beyond, field(size, CV_32F);
  cv::distanceTransform(inside, within, cv::DIST_L2, cv::DIST_MASK_5);
  cv::distanceTransform(255 - inside, beyond, cv::DIST_L2, cv::DIST_MASK_5);
  cv::RNG random = generator(noise, 3, camera_number, tick);
  random.fill(field, cv::RNG::NORMAL, 0, 1);
  // A Gaussian of this width leaves white noise 1 / (2 sqrt(pi) sigma) of its standard deviation.
  const double sigma = kCorrelation_px / 2;
  cv::GaussianBlur(field, field, {0, 0}, sigma);
  field *= noise.segmentation_px * 2 * std::sqrt(std::acos(-1.0)) * sigma;
  // Distances are from centre to centre; the contour lies half a pixel from those of either side.
  const cv::Mat halves(part.size(), CV_32F, cv::Scalar(0.5)), side = within > 0;
  cv::Mat distance = within - beyond;
  cv::subtract(distance, halves, distance, side);
  cv::add(distance, halves, distance, ~side);
  cv::Mat moved(size, CV_8U, cv::Scalar(0));
  cv::Mat((distance + field(part)) > 0).copyTo(moved(part));
  pack_mask(moved.data, mask.width_px, mask.height_px, mask);
}

void disturb_depth(DepthImage& distance_m, const NoiseOptions& noise, int camera_number, std::int64_t tick) {
  if (noise.depth_m == 0 && noise.wiggle_m == 0) return;
  cv::RNG random = generator(noise, 4, camera_number, tick);
  const double wave = 2 * std::acos(-1.0) / kWigglePeriod_m;
  for (float& e : distance_m.pixels) {
    if (!(e > 0)) continue;
    const double d = static_cast<double>(e);
    const double off = noise.wiggle_m * std::sin(wave * d) + random.gaussian(1) * noise.depth_m * d * d;
    e = static_cast<float>(std::max(d + off, 1e-3));
  }
}

}  // namespace tactus
