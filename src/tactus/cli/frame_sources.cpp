#include "tactus/cli/frame_sources.h"

#include <algorithm>
#include <limits>

#include "tactus/base/error.h"
#include "tactus/rig/data_sources.h"
#include "tactus/rig/synthetic_source.h"

namespace tactus {
namespace {

std::unique_ptr<FrameSource> open_synthetic(const SourceDescription& source, const SourceContents& contents) {
  SyntheticOptions options;
  options.figure = source.figure;
  options.shape.moving = source.moving;
  options.shape.scale = static_cast<float>(source.scale);
  options.shape.offset_m = vec_cast<float>(source.offset_m);
  options.fps = source.fps.value_or(30);
  options.truth = contents.truth;
  options.colors = contents.colors;
  options.depth = contents.depth;
  options.rig.depth_cameras = source.depth_cameras;
  // A figure never ends by itself: without a last frame, there are as many as are documented.
  options.first_frame = source.frames.first;
  options.frames = kSyntheticFrames;
  if (source.frames.last)
    options.frames = static_cast<int>(std::min<std::int64_t>(
        std::int64_t{*source.frames.last} - source.frames.first + 1, std::numeric_limits<int>::max()));
  return std::make_unique<SyntheticSource>(options);
}

}  // namespace

std::unique_ptr<FrameSource> open_frame_source(const SourceDescription& source,
                                               const SourceContents& contents) {
  const std::optional<BoxRegion>& workspace_m = contents.workspace_m;
  if (source.kind == SourceKind::synthetic) return open_synthetic(source, contents);
  DataOptions options;
  options.colors = contents.colors;
  options.depth = contents.depth;
  options.fps = source.fps;
  if (workspace_m)
    options.workspace_m = Box3f{vec_cast<float>(workspace_m->min_m), vec_cast<float>(workspace_m->max_m)};
  if (source.frames.first > 0 || source.frames.last) {
    options.first_frame = source.frames.first;
    options.last_frame = source.frames.last;
  }
  static constexpr const char* kKinds[] = {"synthetic", "videos", "masks", "middlebury", "kinect"};
  return open_source(kKinds[static_cast<int>(source.kind)], source.path, options);
}

}  // namespace tactus
