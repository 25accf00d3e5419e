#include "tactus/cli/source_flags.h"

#include <CLI/CLI.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/sources/data_sources.h"

namespace tactus {

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

}  // namespace tactus
