#include "tactus/base/error.h"
#include "tactus/window/window.h"

namespace tactus {

std::string window_missing() {
  return "GLFW and Dear ImGui (libglfw3-dev, libimgui-dev): tactus view opens no window; "
         "tools/install_deps.sh view "
         "installs them";
}

bool show_window(Scene, LiveRun::Options, const WindowOptions&) {
  throw Error("this build has no windows: " + window_missing() + ", then build again");
}

}  // namespace tactus
