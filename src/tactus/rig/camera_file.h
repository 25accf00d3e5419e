#pragma once
/// Calibrations as OpenCV writes them, photos from files, and the look-up that removes lens distortion.
#include <memory>
#include <string>

#include "tactus/geom/camera.h"
#include "tactus/geom/image.h"

namespace tactus {

/// Names of the nodes in an OpenCV XML/YAML calibration.
struct CalibrationNodes {
  std::string intrinsics = "CameraMatrix", distortion = "DistortionCoeffs", rotation = "RotationValues",
              translation = "TranslationValues";
};
struct CalibratedCamera {
  Camera camera;  ///< translation in metres
  std::vector<double> distortion;
};
/// Rotation as a vector of 3 (Rodrigues) or a 3x3 matrix; translations are multiplied by `unit_m`.
/// @throws Error naming the file and the node: missing, of a wrong shape, NaN, or a camera that check_camera
/// refuses; a principal point outside an image of the given size; or image_width and image_height (OpenCV's
/// programs write them) that differ from it.
CalibratedCamera read_calibration(const std::string& file, const CalibrationNodes& nodes, double unit_m,
                                  Index width_px, Index height_px);

/// @throws Error naming the camera when its principal point lies outside its image: then its calibration
/// belongs to another size.
void check_principal_point(const Camera& camera);

/// @throws Error naming the file when it is missing or not a whole image.
ColorImage read_photo(const std::string& file);
/// Foreground: alpha (if there is any transparent pixel), else any channel, at least half bright.
/// @throws Error as read_photo; also when the size is not the expected one.
Image<std::uint8_t> read_mask(const std::string& file, Index width_px, Index height_px);

/// Look-up from the pure pinhole's pixels to the lens's; what lies outside the photo is 0.
class Undistortion {
 public:
  explicit Undistortion(const CalibratedCamera& calibrated);
  ~Undistortion();
  Undistortion(Undistortion&&) noexcept;
  /// 255/0 bytes to a mask; `scratch` is reused.
  void mask(const std::uint8_t* bytes, Image<std::uint8_t>& scratch, BitMask& result) const;
  void color(const std::uint8_t* bgr, ColorImage& result) const;

 private:
  struct Maps;
  std::unique_ptr<Maps> maps_;
};

}  // namespace tactus
