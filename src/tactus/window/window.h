#pragma once
/// The window of `tactus view`.
#include <string>

#include "tactus/window/live_run.h"

namespace tactus {

struct WindowOptions {
  std::string name;  ///< of the scene, for the title
  Vec2i size_px = {1280, 720};
  bool shows_panels = true;
  std::function<bool()> should_close;  ///< asked often; none: never
};

/// Libraries that this build lacks, and how to get them; "" where it has windows.
std::string window_missing();

/// Opens a window, starts the run, and returns when the window was closed. Call it on the main thread.
/// @throws Error when there is no display, no OpenGL 4.5, or the physics ended with an error.
void show_window(LiveRun& run, const WindowOptions& options);

}  // namespace tactus
