#pragma once
/// A picture of the cuts that blades made in a body.
#include <string>

#include "tactus/geom/image/image.h"
#include "tactus/world/world.h"

namespace tactus {

/// Writes STEM-BODY-score.png for each body that was cut: its surface at rest, seen along the way into the
/// cut, with planned lines and cuts, coloured by how far they are off; beside it a table of the strokes.
/// @returns the files @throws Error when there is no OpenGL 4.5 or a file can't be written.
std::vector<std::string> write_score_pictures(const Scene& scene, const World& world,
                                              const std::string& stem);

}  // namespace tactus
