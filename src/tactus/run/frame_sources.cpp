#include "tactus/run/frame_sources.h"

#include <algorithm>
#include <limits>

#include "tactus/base/error.h"
#include "tactus/rig/sources/data_sources.h"
#include "tactus/rig/sources/no_cameras.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/run/live_source.h"

namespace tactus {
namespace {

/// Number of frames of a source that never ends by itself: without a last frame, the documented default
/// (kSyntheticFrames).
int frames_of(const FrameRange& range) {
  if (!range.last) return kSyntheticFrames;
  return static_cast<int>(
      std::min<std::int64_t>(std::int64_t{*range.last} - range.first + 1, std::numeric_limits<int>::max()));
}

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
  options.first_frame = source.frames.first;
  options.frames = frames_of(source.frames);
  return std::make_unique<SyntheticSource>(options);
}

std::unique_ptr<FrameSource> open_none(const SourceDescription& source) {
  return std::make_unique<NoCameras>(source.frames.first, frames_of(source.frames), source.fps.value_or(30));
}

std::unique_ptr<FrameSource> open_live(const SourceDescription& source, const SourceContents& contents) {
  if (source.frames.first > 0 || source.frames.last)
    throw usage_error("'" + source.path + "' is live: it has no range of frames");
  auto live = std::make_unique<LiveSource>(source.path, LiveOptions{.plain = source.plain,
                                                                    .colors = contents.colors,
                                                                    .depth = contents.depth,
                                                                    .alphas = contents.alphas});
  if (contents.workspace_m)
    live->set_workspace(
        {vec_cast<float>(contents.workspace_m->min_m), vec_cast<float>(contents.workspace_m->max_m)});
  return live;
}

}  // namespace

std::unique_ptr<FrameSource> open_frame_source(const SourceDescription& source,
                                               const SourceContents& contents) {
  const std::optional<BoxRegion>& workspace_m = contents.workspace_m;
  if (source.kind == SourceKind::synthetic) return open_synthetic(source, contents);
  if (source.kind == SourceKind::none) return open_none(source);
  if (source.kind == SourceKind::live) return open_live(source, contents);
  DataOptions options;
  options.colors = contents.colors;
  options.depth = contents.depth;
  options.alphas = contents.alphas;
  options.fps = source.fps;
  options.threshold = contents.threshold;
  if (workspace_m)
    options.workspace_m = Box3f{vec_cast<float>(workspace_m->min_m), vec_cast<float>(workspace_m->max_m)};
  if (source.frames.first > 0 || source.frames.last) {
    options.first_frame = source.frames.first;
    options.last_frame = source.frames.last;
  }
  return open_source(source.kind, source.path, options);
}

}  // namespace tactus
