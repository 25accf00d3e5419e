#pragma once
/// Photos and masks without their lens.
#include <cstdint>
#include <memory>

#include "tactus/geom/camera/lens.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// Look-up from the pixels of `undistorted_camera` to those of the photo. Made once per camera; `mask` and
/// `color` allocate nothing after the first call.
class Undistortion {
 public:
  /// @throws Error as undistorted_camera.
  explicit Undistortion(const CalibratedCamera& calibrated);
  ~Undistortion();
  Undistortion(Undistortion&&) noexcept;
  /// The pinhole whose pictures come out.
  const Camera& camera() const;
  /// 255/0 bytes of the photo's size to a mask of `camera()`; `scratch` is reused.
  void mask(const std::uint8_t* bytes, Image<std::uint8_t>& scratch, BitMask& result) const;
  /// Bytes of the photo's size to those of `camera()`, bilinear.
  void bytes(const std::uint8_t* bytes, Image<std::uint8_t>& result) const;
  /// Packed bits of the photo's size to a mask of `camera()`: the same bits as from bytes (bilinear, at least
  /// half). Words of 32 pixels whose source is all set or all clear cost no look at their pixels.
  void mask(const BitMask& photo, BitMask& result) const;
  /// Blue, green, red bytes of the photo's size to a picture of `camera()`.
  void color(const std::uint8_t* bgr, ColorImage& result) const;

 private:
  struct Maps;
  std::unique_ptr<Maps> maps_;
};

}  // namespace tactus
