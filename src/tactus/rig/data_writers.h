#pragma once
/// Writes the files that a rig file names: calibrations, masks, distances.
#include <string>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// OpenCV YAML with the default CalibrationNodes and the image size, metres, no distortion. @throws Error
/// naming the file.
void write_calibration(const std::string& file, const Camera& camera);
/// 8-bit PNG, 255 inside. @throws Error naming the file.
void write_mask(const std::string& file, const BitMask& mask);
/// 8-bit PNG. @throws Error naming the file.
void write_alpha(const std::string& file, const AlphaImage& alpha);
/// 16-bit PNG, radial distance in units of 0.1 mm, 0: no measurement; distances beyond 6.5535 m are written
/// as 0.
/// @throws Error naming the file.
void write_depth(const std::string& file, const DepthImage& distance_m);

}  // namespace tactus
