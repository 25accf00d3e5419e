#pragma once
/// The scene that `tactus view` runs.
#include <string>

#include "tactus/sim/scene.h"

namespace tactus {

struct ViewedScene {
  Scene scene;
  std::string tool;  ///< name of the obstacle that the mouse holds; "": none
};

/// Reads a scene file, or a recording or a rig file: then there are no bodies. Scenes that nothing ends go on
/// without end.
/// @param source_path "", or a recording or rig that replaces the scene's source
/// @param tool "none", "auto" or the name of a held obstacle. auto: the scene's first one; where it has none,
/// and bodies, a ball beside them @throws usage Error for another name
ViewedScene viewed_scene(const std::string& path, const std::string& source_path, const std::string& tool);

}  // namespace tactus
