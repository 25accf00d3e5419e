#pragma once
/// One door to all kinds of frame sources.
#include <memory>

#include "tactus/rig/frame_source.h"
#include "tactus/rig/silhouettes.h"
#include "tactus/sim/scene.h"

namespace CLI {
class App;
}

namespace tactus {
/// What of a source is wanted besides silhouettes.
struct SourceContents {
  bool truth = false;                         ///< the volume of synthetic figures
  bool alphas = false;                        ///< of videos: 8-bit edges of the silhouettes
  bool colors = false;                        ///< photos, where there are any
  bool depth = true;                          ///< the depth camera, where there is one
  std::optional<BoxRegion> workspace_m = {};  ///< instead of the source's own
  ThresholdOptions threshold = {};            ///< of Middlebury's silhouettes
};

/// From `--source`, its argument and `--frames` ("": the first; of videos all). @throws usage Error naming
/// the flag.
SourceDescription describe_source(const std::string& kind, const std::string& what,
                                  const std::string& frames);

/// `--mask-threshold` and `--largest-hole-px`: how photos of Middlebury's sets become silhouettes.
void add_threshold_flags(CLI::App& command, ThresholdOptions& options);
/// @throws usage Error naming the flag that is out of range.
void check_threshold_flags(const ThresholdOptions& options);

/// @throws Error naming file, figure or value.
std::unique_ptr<FrameSource> open_frame_source(const SourceDescription& source,
                                               const SourceContents& contents = {});
}  // namespace tactus
