#pragma once
/// Silhouettes from photos: threshold recipe and background subtraction.
#include <memory>

#include "tactus/geom/image.h"

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

/// A pixel is foreground when its colour is off the line black-background (chromaticity distortion) or its
/// brightness ratio is not that of a shadow (Horprasert, Harwood, Davis 1999).
struct BackgroundOptions {
  double chroma = 11;            ///< distance off the line [grey levels]
  double darkest_shadow = 0.55;  ///< brightness ratios below are foreground
  double brightest = 1.25;       ///< brightness ratios above are foreground
  double noise = 16;  ///< a darker or brighter pixel within this distance is background [grey levels]
  int open_px = 1, close_px = 3;
  int largest_hole_px = 150;  ///< smaller holes are filled [pixels]
};

/// Per-pixel mean of the empty room.
class BackgroundModel {
 public:
  BackgroundModel(Index width_px, Index height_px);
  ~BackgroundModel();
  BackgroundModel(BackgroundModel&&) noexcept;
  /// One more photo of the empty room (BGR bytes, tightly packed).
  void learn(const std::uint8_t* bgr);
  /// 255 where foreground (width x height bytes).
  void classify(const std::uint8_t* bgr, const BackgroundOptions& options, std::uint8_t* result) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Packs bytes (>= 128: set).
void pack_mask(const std::uint8_t* bytes, Index width_px, Index height_px, BitMask& mask);

}  // namespace tactus
