#pragma once
/// `tactus run --checkpoint FILE` and `--restart FILE`.
#include <string>

#include "tactus/sim/simulation.h"

namespace tactus {

/// How far a run has come in its source.
struct RunProgress {
  std::int64_t taken = 0;  ///< frames of the source, bad ones too
  double last_time_s = 0;  ///< of the last good one
  bool has_time = false;
  FrameSet last;  ///< that one
  bool has_last = false;
};

/// After the last frame. @throws Error when the file can't be written.
void write_checkpoint(const std::string& path, const std::string& scene_path, const RunProgress& progress,
                      Simulation& simulation);
/// Before the first: reads the frames of the source that were taken, and takes over the state after them.
/// @throws Error naming what differs: another scene, another program's file, a source that ends before.
void read_checkpoint(const std::string& path, const std::string& scene_path, FrameSource& source,
                     RunProgress& progress, Simulation& simulation);

}  // namespace tactus
