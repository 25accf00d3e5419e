#pragma once
/// One door to all kinds of frame sources.
#include <memory>

#include "tactus/rig/frame_source.h"
#include "tactus/sim/scene.h"

namespace tactus {
/// `truth`: synthetic sources also measure the figure's volume. `colors`: photos, too, where there are any.
/// @throws Error naming file, figure or value.
std::unique_ptr<FrameSource> open_frame_source(const SourceDescription& source, bool truth = false,
                                               std::optional<BoxRegion> workspace_m = {},
                                               bool colors = false);
}  // namespace tactus
