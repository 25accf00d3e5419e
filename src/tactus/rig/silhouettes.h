#pragma once
/// Silhouettes from photos by a threshold; background_model.h has those before a known room.

#include "tactus/geom/image.h"

namespace tactus {

/// Brightness threshold for an object before black (README of the Middlebury data sets).
struct ThresholdOptions {
  double threshold = 0.19;  ///< of the largest channel, 0..1
  int dilate_px = 10, erode_px = 7;
  int largest_hole_px =
      150;  ///< smaller holes are filled [pixels]: dark spots, not what is seen through an object
};
/// Bright pixels, dilated, eroded, small holes filled, largest component.
BitMask threshold_silhouette(const ColorImage& photo, const ThresholdOptions& options);

/// Packs bytes (>= 128: set).
void pack_mask(const std::uint8_t* bytes, Index width_px, Index height_px, BitMask& mask);

}  // namespace tactus
