#pragma once
/// A run that stops and goes on with the same bits.
#include <string>

#include "tactus/run/frame_loop.h"

namespace tactus {

/// Takes the first `count` frames of a source once more. @returns the last that had images; none: none had
/// @throws Error beginning with `path` when the source has fewer.
std::optional<FrameSet> take_again(FrameSource& source, std::int64_t count, const std::string& path);
/// After the last frame. @throws Error when the file can't be written.
void write_checkpoint(const std::string& path, const std::string& scene_path, const RunProgress& progress,
                      World& world);
/// Before the first: reads the frames of the source that were taken, and takes over the state after them.
/// @throws Error naming the difference: another scene, another program's file, a source that ends before.
RunProgress read_checkpoint(const std::string& path, const std::string& scene_path, FrameSource& source,
                            World& world);

}  // namespace tactus
