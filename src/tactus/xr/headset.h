#pragma once
/// A running scene in a headset, by OpenXR: `tactus xr`.
#include <functional>
#include <string>

#include "tactus/sim/scene.h"

namespace tactus {

struct HeadsetOptions {
  std::string named = "scene";  ///< before messages: the scene's file
  std::string devices = "auto";
  /// Where the middle of the scene's own picture lies in the room [m]: above the floor (+y), and before the
  /// viewer (-z) who stands in the middle of the room.
  Vec3d at_m{0, 1, -0.55};
  std::function<bool()> should_close{};  ///< asked each frame; none: never
};

/// The library that this build lacks, and how to get it; "" where it has headsets.
std::string headset_missing();

/// Runs the scene on a thread of its own and shows it until the runtime ends the session, or the caller does.
/// @throws Error when there is no runtime or no headset, when it is lost, or when physics ended with an
/// error.
void show_in_headset(Scene scene, const HeadsetOptions& options);

}  // namespace tactus
