#pragma once
/// One door to all kinds of frame sources.
#include <memory>

#include "tactus/rig/frame_source.h"
#include "tactus/sim/scene.h"

namespace tactus {
/// `truth`: synthetic sources also measure the figure's volume; `depth`: their
/// depth camera is there. @throws Error naming file, figure or value.
std::unique_ptr<FrameSource> open_frame_source(const SourceDescription& source, bool truth = false,
                                               bool depth = true, std::optional<BoxRegion> workspace_m = {});
}  // namespace tactus
