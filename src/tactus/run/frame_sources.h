#pragma once
/// One door to all kinds of frame sources.
#include <memory>

#include "tactus/rig/images/silhouettes.h"
#include "tactus/rig/sources/frame_source.h"
#include "tactus/sim/scene.h"

namespace tactus {
/// The data that a source delivers besides silhouettes.
struct SourceContents {
  bool truth = false;                         ///< the volume of synthetic figures
  bool alphas = false;                        ///< of videos: 8-bit edges of the silhouettes
  bool colors = false;                        ///< photos, where there are any
  bool depth = true;                          ///< the depth camera, where there is one
  std::optional<BoxRegion> workspace_m = {};  ///< instead of the source's own
  ThresholdOptions threshold = {};            ///< of Middlebury's silhouettes
};

/// @throws Error naming file, figure or value.
std::unique_ptr<FrameSource> open_frame_source(const SourceDescription& source,
                                               const SourceContents& contents = {});
}  // namespace tactus
