#pragma once
/// Silhouettes from photos by a threshold; background_model.h has those before a known room.

#include "tactus/geom/image/image.h"

namespace tactus {

/// Brightness threshold for an object before black (README of the Middlebury data sets).
struct ThresholdOptions {
  double threshold = 0.19;  ///< of the largest channel, 0..1
  int dilate_px = 10, erode_px = 7;
  /// Smaller holes are filled [pixels]: shadows on an opaque object (1500 fills all of Middlebury's dino).
  /// Larger ones are seen through.
  int largest_hole_px = 1500;
};
/// Bright pixels, dilated, eroded, small holes filled, largest component.
BitMask threshold_silhouette(const ColorImage& photo, const ThresholdOptions& options);

/// Packs bytes (>= 128: set).
void pack_mask(const std::uint8_t* bytes, Index width_px, Index height_px, BitMask& mask);

}  // namespace tactus
