#pragma once
/// Where the contour of a subject runs, to the pixel.
#include "tactus/geom/image/image.h"

namespace tactus {

/// A photo and the empty room behind it.
struct PhotoOfRoom {
  const std::uint8_t* bgr;      ///< tightly packed
  const std::uint8_t* room[3];  ///< planes
  const std::uint8_t* noise;    ///< distance within which a pixel is background
};

/// Clears pixels of the mask that are nearer to the room than to the subject: a pixel p on the contour mixes
/// the room b and the subject f beside it, p = b + alpha (f - b), and belongs to it from alpha = 0.5 on.
/// Smoothing before the decision and closing gaps after it both widen masks. f is the mean of `core` pixels
/// around, which are surely subject. Where it looks like the room, alpha says nothing and the pixel stays.
void refine_edges(const PhotoOfRoom& photo, const BitMask& core, BitMask& mask);

/// The alpha of each pixel: of `band` as above, elsewhere, and where alpha says nothing, that of the mask.
/// `alpha` has the mask's size.
void edge_alpha(const PhotoOfRoom& photo, const BitMask& core, const BitMask& band, const BitMask& mask,
                AlphaImage& alpha);

}  // namespace tactus
