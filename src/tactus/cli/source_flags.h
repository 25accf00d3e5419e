#pragma once
/// `--source`, `--frames` and how photographs become masks, as several verbs have them.
#include "tactus/rig/images/silhouettes.h"
#include "tactus/sim/scene.h"

namespace CLI {
class App;
}

namespace tactus {

/// From `--source`, its argument and `--frames` ("": the first; of videos all). @throws usage Error naming
/// the flag.
SourceDescription describe_source(const std::string& kind, const std::string& what,
                                  const std::string& frames);

/// `--mask-threshold` and `--largest-hole-px`: how photos of Middlebury's sets become silhouettes.
void add_threshold_flags(CLI::App& command, ThresholdOptions& options);
/// @throws usage Error naming the flag that is out of range.
void check_threshold_flags(const ThresholdOptions& options);

}  // namespace tactus
