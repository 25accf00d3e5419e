#pragma once
/// Square ArUco markers in pictures (Garrido-Jurado et al. 2014).
#include <span>
#include <string>
#include <vector>

#include "tactus/rig/sources/frame_source.h"

namespace tactus {

/// Why markers can't be found here; "": they can.
std::string markers_missing();
/// All markers of a dictionary, with corners to about a third of a pixel. A marker has to be 15 pixels wide
/// or more. Cameras whose picture is empty see none.
/// @throws usage Error as marker_dictionary; Error where markers can't be found.
std::vector<SeenMarker> find_markers(std::span<const ColorImage> pictures, const std::string& dictionary);

}  // namespace tactus
