#pragma once
/// A rig described by a YAML file: cameras with their recordings, the world, the workspace.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tactus/geom/camera/lens.h"
#include "tactus/rig/background/background_model.h"
#include "tactus/rig/images/depth_files.h"
#include "tactus/rig/live.h"
#include "tactus/rig/sources/frame_source.h"

namespace tactus {

struct RigFile {
  Rig rig;  ///< world +Y up, metres; its cameras are the undistorted ones
  std::vector<CalibratedCamera>
      calibrated;  ///< the same cameras with their lenses and the size of their photos
  /// From the world to that of the calibrations: R_cam_file = R_cam_world * R_file_world^-1.
  Mat3d R_file_world = Mat3d::identity();
  std::vector<std::string> videos, backgrounds, masks,
      photos;                          ///< one per camera, "" where not given
  std::vector<DepthRecording> depths;  ///< `rig` has no depth cameras until a source reads them
  BackgroundOptions background;
  std::optional<int> first_frame, last_frame;  ///< inclusive; none: all
  std::optional<double> frames_per_s;          ///< none: the recording's own
  std::vector<std::string> devices;            ///< one per camera, "" where not given
  LiveSettings live;
};
/// @throws Error naming file and line.
RigFile read_rig_file(const std::string& path);

/// Runs `body`; its Errors get "path: camera 'name': " before them and keep their kind.
void for_camera(const std::string& path, const std::string& name, const std::function<void()>& body);

/// Absolute; else beside `beside`; else under $TACTUS_DATA; else under ../shared/data.
/// @throws Error "file:..." when there is none, with the nearest name; patterns (with %) are matched by their
/// folder.
std::string find_data(const std::string& path, const std::string& beside);

}  // namespace tactus
