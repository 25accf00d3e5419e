#pragma once
/// The errors of real rigs, added to exact data. Deterministic: the same seed gives the same noise.
#include <cstdint>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// Standard deviations; 0: none.
struct NoiseOptions {
  double calibration_px = 0;   ///< of the reprojection at the image centre, by a wrong direction of view
  double sync_ms = 0;          ///< of each camera's moment about the tick
  double segmentation_px = 0;  ///< of the contour, with a correlation length of about 8 px
  double depth_m = 0;          ///< of time-of-flight distances at 1 m; grows with the square of the distance
  double wiggle_m = 0;  ///< amplitude of the systematic error over distance (period 0.47 m, 80 MHz / 4)
  std::uint64_t seed = 1;
};
/// @throws usage_error naming a value below 0 or not finite.
void check_noise(const NoiseOptions& noise);

/// The camera that a slightly wrong calibration believes in.
Camera miscalibrate(const Camera& camera, const NoiseOptions& noise, int camera_number);
/// Seconds that this camera is late (or early) at a tick.
double sync_error_s(const NoiseOptions& noise, int camera_number, std::int64_t tick);
/// Moves the contour in and out.
void disturb_mask(BitMask& mask, const NoiseOptions& noise, int camera_number, std::int64_t tick);
/// Adds wiggling and noise to measured distances; 0 stays 0.
void disturb_depth(DepthImage& distance_m, const NoiseOptions& noise, int camera_number, std::int64_t tick);

}  // namespace tactus
