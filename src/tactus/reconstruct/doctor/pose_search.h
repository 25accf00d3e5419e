#pragma once
/// Where a camera would have to stand for its silhouette to agree with a hull.
#include "tactus/reconstruct/doctor/rig_hypotheses.h"
#include "tactus/reconstruct/doctor/silhouette_consistency.h"

namespace tactus {

struct FoundPose {
  Camera camera;
  double cost = 0;  ///< lost recall of all views, 0: none
};

/// From the given pose, or turned so that the mask lies on the hull's image, by pattern search (Hooke and
/// Jeeves 1961): turns first, then all six parameters, with steps that shrink to a third of a pixel.
FoundPose search_pose(const SilhouetteConsistency& trusted, const SeenView& view);

}  // namespace tactus
