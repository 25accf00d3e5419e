#pragma once
/// Images of a rig's cameras as a window shows them: plain data of its own.
#include <memory>
#include <string>
#include <vector>

#include "tactus/rig/sources/frame_source.h"

namespace tactus {

struct CameraLook {
  int number = 0;  ///< of the frame
  std::shared_ptr<const Rig> rig;
  /// One per camera, 0x0 where it missed the tick; none where the frame had no new images.
  std::vector<BitMask> silhouettes;
  /// Since each camera's newest image; 0: it is in this frame; < 0: there was none yet.
  std::vector<double> late_s;
  std::string links_json;  ///< FrameSource's
};

}  // namespace tactus
