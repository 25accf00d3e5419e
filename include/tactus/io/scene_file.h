#pragma once
/// Scene files: YAML in, a checked Scene out; and the reference of all keys. See docs/scene.md.
#include <iosfwd>
#include <string>

#include "tactus/sim/scene.h"

namespace tactus {

/// Reads and checks a scene file. Paths in it are resolved: `$TACTUS_DATA` at their start is replaced by
/// the environment variable, and relative ones start at the scene file's folder. They are not opened.
/// @throws Error `failure` when the file can't be read; `usage` for the first thing wrong in it, as
///         `FILE:LINE: the fault, expected ...`.
Scene read_scene(const std::string& path);

/// As read_scene, from text; `path` names it in errors and anchors relative paths.
Scene parse_scene(const std::string& text, const std::string& path);

/// Reads the meshes [m] and label volumes that the scene's bodies name.
/// @throws Error naming the file that can't be read.
BodyAssets load_body_assets(const Scene& scene);

/// Writes the reference of the scene file (Markdown): docs/scene.md is exactly this.
void write_scene_reference(std::ostream& out);

}  // namespace tactus
