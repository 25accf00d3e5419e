#pragma once
/// The window of `tactus view`.
#include <string>

#include "tactus/window/live_run.h"

namespace tactus {

struct WindowOptions {
  std::string name;  ///< of the scene, for the title
  Vec2i size_px = {1280, 720};
  bool shows_panels = true, is_paused = false;  ///< paused: from the first frame on
  std::function<bool()> should_close;           ///< asked often; none: never
};

/// Libraries that this build lacks, and how to get them; "" where it has windows.
std::string window_missing();

/// Opens a window, runs the scene, and returns when the window was closed. Call it on the main thread.
/// @returns false where the last frame takes so long that nobody waits for it: then the process must end at
/// once, without destructors
/// @throws Error when there is no display, no OpenGL 4.5, or the physics ended with an error.
bool show_window(Scene scene, LiveRun::Options run_options, const WindowOptions& options);

}  // namespace tactus
