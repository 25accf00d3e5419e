#pragma once
/// Middlebury's cameras, for their folders too, where the photos say how large they are.
#include <string>
#include <vector>

#include "tactus/geom/camera/camera.h"

namespace tactus {

struct MiddleburyCamera {
  Camera camera;      ///< without the size of its image, not checked
  std::string where;  ///< "FILE:LINE", for messages
};
/// @throws Error naming file and line.
std::vector<MiddleburyCamera> read_middlebury_cameras(const std::string& text, const std::string& file);

}  // namespace tactus
