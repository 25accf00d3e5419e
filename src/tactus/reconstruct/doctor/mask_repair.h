#pragma once
/// Fills holes in the mask of a suspect view from the space that all other views keep. Only where that view
/// alone carves deep into their hull: contours that merely disagree stay as they are, so nothing else grows.
#include <span>
#include <string>
#include <vector>

#include "tactus/reconstruct/texture/view_scores.h"

namespace tactus {

struct RepairedMask {
  std::size_t camera = 0;
  std::int64_t filled_px = 0;
};

struct MaskRepairOptions {
  /// A hole is filled when it costs at least this share of the hull's volume.
  double least_share = 0.005;
};

/// Repairs the masks of views that `found` (measured by `scores` from these very masks) calls suspect, the
/// worst view first, and measures anew after each step until no view is suspect: first the space that a view
/// carves through holes within its mask, then, region by region and the largest first, the space that it
/// carves from outside. It fills background pixels within two samples of the carved space, where some point
/// before the camera is inside all other silhouettes. A hole that is really there and that only one camera
/// looks through is filled, too. The masks are on the host; results are the same on every device. Views that
/// missed the tick (0x0) take no part.
/// @returns the masks that were changed.
std::vector<RepairedMask> repair_masks(ExecContext& ctx, ViewScores& scores, std::span<const ViewScore> found,
                                       std::vector<BitMask>& silhouettes,
                                       const MaskRepairOptions& options = {});

/// "5012 px of the mask of camera 'x' were filled"; empty without repairs.
std::string repairs_text(std::span<const Camera> cameras, std::span<const RepairedMask> repairs);

}  // namespace tactus
