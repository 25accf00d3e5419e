#pragma once
/// A photo's rows on their way to a mask: smoothed, taken apart into colours, and decided. A row's buffers
/// stay in the first-level cache.
#include <vector>

#include "tactus/geom/image/image.h"

namespace tactus {

/// One row of a photo, smoothed over 3x3 pixels with the weights 1 2 1: the noise goes before the decision,
/// which keeps edges truer than cleaning the mask afterwards. Images are continued by reflection.
class SmoothedRow {
 public:
  SmoothedRow(Index width_px, Index height_px);
  /// Takes row y of a picture (BGR bytes, tightly packed).
  void load(const std::uint8_t* bgr, Index y);
  /// Blue, green or red, as long as whole words of 32 pixels.
  const std::uint8_t* plane(std::size_t channel) const { return planes_[channel].data(); }

 private:
  Index width_px_, height_px_;
  std::vector<std::uint16_t> columns_;  ///< sums over three rows, and a pixel more on either side
  std::vector<std::uint8_t> bgr_, planes_[3];
};

/// The room before which pixels are decided, a row of it.
struct RoomRow {
  const std::uint8_t* plane[3];
  const std::uint8_t* noise;    ///< distance within which a pixel is background
  const std::uint8_t* nothing;  ///< three channels that differ by no more lie within `noise`
};
struct Decision {
  float chroma2, darkest, brightest;
};

/// Foreground of a row as bits, 32 pixels a word.
void decide_row(Index width, const SmoothedRow& photo, const RoomRow& room, const Decision& how,
                std::uint32_t* bits);
/// Foreground where the colour's direction is off the key's: |p|^2 |k|^2 cos^2 > (p.k)^2.
void key_row(Index width, const SmoothedRow& photo, Rgb8 key, float cos2, std::uint32_t* bits);
/// Foreground where bytes are above a value.
void threshold_row(Index width, const std::uint8_t* bytes, std::uint8_t above, std::uint32_t* bits);

}  // namespace tactus
