#pragma once
/// The workspace that the silhouettes themselves name: where their cones meet.
#include <optional>
#include <span>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"

namespace tactus {

struct ConeBox {
  Box3f box_m;
  /// False: the cones leave some direction open (masks that touch the border of their images, too few
  /// cameras); the box then ends where no camera stands any more.
  bool is_bounded = true;
};

/// A box around the convex intersection of the pyramids over the masks' bounding rectangles, cut tighter by
/// carving coarse lattices of samples, with a margin of two samples. A side of a rectangle on the image's
/// border bounds nothing: the object may go on there. Masks without a set pixel, and those that are not there
/// (0x0), do not count. None when the cones do not meet or no mask counts.
std::optional<ConeBox> workspace_from_cones(std::span<const Camera> cameras,
                                            std::span<const BitMask> silhouettes);
/// Likewise of masks that lie apart; null: not there.
/// @param turns of carving that make the box tighter; 0: the box of the pyramids' intersection
std::optional<ConeBox> workspace_from_cones(std::span<const Camera> cameras,
                                            std::span<const BitMask* const> silhouettes, int turns = 2);

}  // namespace tactus
