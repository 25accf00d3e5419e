#pragma once
/// The frames that a scene asks for.
#include "tactus/rig/sources/frame_source.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// The scene's source, with markers found where a tool wears some.
/// @param named before messages: the scene's file
/// @throws Error naming file, figure or value; when a scene wants markers, and they can't be found here. A
/// source without the photographs that the scene wants throws at its first frame.
std::unique_ptr<FrameSource> open_scene_source(const Scene& scene, const std::string& named = "scene");

/// Whether a tool of the scene is found by markers.
bool has_markers(const Scene& scene);

}  // namespace tactus
