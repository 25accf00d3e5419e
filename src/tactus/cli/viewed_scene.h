#pragma once
/// The scene that `tactus view` runs.
#include <string>
#include <vector>

#include "tactus/sim/scene.h"

namespace tactus {

struct ViewedScene {
  Scene scene;
  std::vector<std::string> tools;  ///< that the mouse may hold, by name; the one in the hand first
};

/// Whether a file is a recording or a rig file: images of cameras, without a scene.
bool is_film(const std::string& path);
/// Reads a scene file, or a recording or a rig file: then there are no bodies. Scenes that nothing ends go on
/// without end.
/// @param source_path "", or a recording or rig that replaces the scene's source
/// @param tool "none", "auto", "ball", "hook", "scalpel" or the name of a held obstacle or blade. auto: the
/// scene's held ones; where it has none, a ball beside its bodies, and a hook; where blades may cut and none
/// is held, a scalpel, too. ball, hook and scalpel are added; a scalpel makes bodies of elements cuttable.
/// @param adds_hook false: auto adds none, so that an only ball comes into a headset's hand from afar
/// @throws usage Error for another name, and for a scalpel where no body has elements
ViewedScene viewed_scene(const std::string& path, const std::string& source_path, const std::string& tool,
                         bool adds_hook = false);

}  // namespace tactus
