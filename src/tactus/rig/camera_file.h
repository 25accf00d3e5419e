#pragma once
/// Calibrations as OpenCV writes them, and photos from files.
#include <string>

#include "tactus/geom/image.h"
#include "tactus/geom/lens.h"

namespace tactus {

/// Names of the nodes in an OpenCV XML/YAML calibration.
struct CalibrationNodes {
  std::string intrinsics = "CameraMatrix", distortion = "DistortionCoeffs", rotation = "RotationValues",
              translation = "TranslationValues";
};
/// Rotation as a vector of 3 (Rodrigues) or a 3x3 matrix; translations are multiplied by `unit_m`.
/// @throws Error naming the file and the node: missing, of a wrong shape, NaN, or a camera that check_camera
/// refuses; or image_width and image_height (OpenCV's programs write them) that differ from the given size.
CalibratedCamera read_calibration(const std::string& file, const CalibrationNodes& nodes, double unit_m,
                                  Index width_px, Index height_px);

/// @throws Error naming the file when it is missing or not a whole image.
ColorImage read_photo(const std::string& file);
/// Foreground: alpha (if there is any transparent pixel), else any channel, at least half bright.
/// @throws Error as read_photo; also when the size is not the expected one.
Image<std::uint8_t> read_mask(const std::string& file, Index width_px, Index height_px);

}  // namespace tactus
