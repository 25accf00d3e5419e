#include "tactus/cli/frame_sources.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>

#include "tactus/base/error.h"
#include "tactus/cli/live_source.h"
#include "tactus/rig/data_sources.h"
#include "tactus/rig/no_cameras.h"
#include "tactus/rig/synthetic_source.h"

namespace tactus {
namespace {

/// Of a source that never ends by itself: without a last frame, there are as many as are documented.
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

SourceDescription describe_source(const std::string& kind, const std::string& what,
                                  const std::string& frames) {
  SourceDescription source;
  source.kind = source_kind(kind);
  (source.kind == SourceKind::synthetic ? source.figure : source.path) = what;
  const bool has_many = source.kind == SourceKind::videos || source.kind == SourceKind::recording ||
                        source.kind == SourceKind::live;
  source.frames = {0, has_many ? std::nullopt : std::optional<int>(0)};
  if (frames.empty()) return source;
  const std::optional<FrameRange> range = parse_frame_range(frames);
  if (!range) throw usage_error("--frames '" + frames + "': expected A-B, A- or A with 0 <= A <= B");
  source.frames = *range;
  return source;
}

void add_threshold_flags(CLI::App& command, ThresholdOptions& options) {
  command
      .add_option("--mask-threshold", options.threshold,
                  "middlebury: brightness of the subject, of the largest channel, 0 to 1")
      ->capture_default_str();
  command
      .add_option("--largest-hole-px", options.largest_hole_px,
                  "middlebury: smaller holes of a silhouette are filled [pixels]; what is seen through the "
                  "subject stays")
      ->capture_default_str();
}

void check_threshold_flags(const ThresholdOptions& options) {
  if (!(options.threshold > 0 && options.threshold < 1))
    throw usage_error("--mask-threshold " + number_text(options.threshold) +
                      ": expected above 0 and below 1");
  if (options.largest_hole_px < 0)
    throw usage_error("--largest-hole-px " + std::to_string(options.largest_hole_px) +
                      ": expected 0 (none) or more");
}

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
