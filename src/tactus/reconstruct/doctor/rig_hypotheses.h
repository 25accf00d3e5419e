#pragma once
/// Slips that people make when they bring cameras along: as functions that undo them.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"

namespace tactus {

enum class MaskFlip : std::uint8_t { none, u, v };

/// A slip, and its cure applied to a camera or to its mask.
struct RigHypothesis {
  std::string fault;                          ///< "pose inverted"
  std::string cure;                           ///< "invert the pose: ..."
  Camera (*camera)(const Camera&) = nullptr;  ///< null: stays as it is
  MaskFlip flip = MaskFlip::none;
  double unit = 1;  ///< factor on the translation
  Camera apply(const Camera& given) const;
};

/// Simple slips, which one camera or all may have.
std::span<const RigHypothesis> rig_hypotheses();
/// Two at once, of poses and of images: for all cameras of a rig.
std::vector<RigHypothesis> combined_hypotheses();

/// The mask with its columns or rows reversed.
BitMask flipped(const BitMask& mask, MaskFlip flip);

/// The rotation vector of a turn, in the camera's frame [rad], then a shift in it [m].
struct CameraMotion {
  Vec3d turn_rad, shift_m;
};
Camera moved(const Camera& camera, const CameraMotion& motion);

}  // namespace tactus
