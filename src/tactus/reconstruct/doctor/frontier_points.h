#pragma once
/// Features that two silhouettes of any object must have in common: the planes through both cameras that
/// touch it (its frontier points). They tell a focal length that recall of the hull can't see.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/reconstruct/doctor/silhouette_consistency.h"

namespace tactus {

/// Another focal length that explains the masks.
struct FocalFit {
  int view = -1;                               ///< of which; -1: of all
  double factor = 1;                           ///< on the focal lengths given
  double deviation = 0;                        ///< of the factor
  double by_calibration = 0;                   ///< deviation that a calibration right to 0.3 px may add
  double planes = 0;                           ///< that tell how well it is known
  double rms_before_px = 0, rms_after_px = 0;  ///< of touching planes, the better three quarters
  /// "the focal lengths of all cameras are 5 % too long", without a cure.
  std::string text(std::span<const Camera> cameras) const;
};

/// The focal lengths with which silhouettes agree much better than with those given: of all cameras by one
/// factor, or of one camera, from 0.8 to 1.25. None where they are right to 4.2 %,
/// where the masks do not tell (the factor differs from 1 by less than five deviations, more where few planes
/// tell it, as of a body of revolution that all cameras see alike), where planes differ by less than half a
/// pixel, or do not come a fifth nearer; nor, of all cameras, where a calibration that is right to 0.3 px
/// passes for 5 %, as with a ball. Masks have no planes where they end at the border of their picture or in a
/// thin tip.
/// @param views with masks; at least four, six for focal lengths that are wrong alike
std::optional<FocalFit> better_focal_lengths(std::span<const SeenView> views);

}  // namespace tactus
