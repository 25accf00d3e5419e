#pragma once
/// A rig described by a YAML file: cameras with their recordings, the world, the workspace.
#include <string>
#include <vector>

#include "tactus/rig/camera_file.h"
#include "tactus/rig/frame_source.h"
#include "tactus/rig/silhouettes.h"

namespace tactus {

struct RigFile {
  Rig rig;  ///< world +Y up, metres
  std::vector<CalibratedCamera> calibrated;
  std::vector<std::string> videos, backgrounds, masks,
      photos;  ///< one per camera, "" where not given
  BackgroundOptions background;
  int first_frame = 0, last_frame = -1;  ///< inclusive; -1: to the end
  double frames_per_s = 50;
};
/// @throws Error naming file and line.
RigFile read_rig_file(const std::string& path);

/// Absolute; else beside `beside`; else under $TACTUS_DATA; else under ../shared/data.
/// @throws Error "file:..." when there is none; patterns (with %) are matched by their folder.
std::string find_data(const std::string& path, const std::string& beside);

}  // namespace tactus
