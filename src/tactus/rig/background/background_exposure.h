#pragma once
/// How a camera's exposure changed since it saw the empty room: gain and offset of each colour.
#include <array>
#include <vector>

#include "tactus/geom/image/image.h"

namespace tactus {

/// photo = gain * room + offset [grey levels]
struct ColorExposure {
  double gain = 1, offset = 0;
  double shown(double room) const { return gain * room + offset; }
  double room_of(double shown) const { return (shown - offset) / gain; }
  friend bool operator==(const ColorExposure&, const ColorExposure&) = default;
};
using Exposure = std::array<ColorExposure, 3>;  ///< blue, green, red

/// Fits the exposure to the pixels of a grid that are likely to be room. Owns the samples; one per camera.
class ExposureFit {
 public:
  ExposureFit(Index width_px, Index height_px);
  /// The exposure of a photo, robustly: the mode of the ratios, then least squares with Tukey's biweight.
  /// Changes of less than four grey levels everywhere are none. Where fewer than three in ten pixels agree,
  /// the last answer stays. Allocates nothing.
  /// @param bgr tightly packed @param room planes of blue, green, red
  /// @param subject where the subject was in the last photo; it is left out, unless that leaves little
  const Exposure& fit(const std::uint8_t* bgr, const std::uint8_t* const (&room)[3], const BitMask& subject);

 private:
  struct Sample {
    float room[3], photo[3];
  };
  void collect(const std::uint8_t* bgr, const std::uint8_t* const (&room)[3], const BitMask* subject);
  double mode_of_gain() const;
  bool fit_channel(std::size_t channel, double gain, ColorExposure& result);

  Index width_px_, height_px_, step_px_;
  std::vector<Sample> samples_;
  std::vector<float> residuals_;
  Exposure exposure_;
};

}  // namespace tactus
