#include "tactus/base/error.h"
#include "tactus/xr/headset.h"

namespace tactus {

std::string headset_missing() {
  return "OpenXR (libopenxr-dev): tactus xr shows nothing in a headset; tools/install_deps.sh xr installs it";
}

void show_in_headset(Scene, const HeadsetOptions&) {
  throw Error("this build knows no headsets: " + headset_missing() + ", then build again");
}

}  // namespace tactus
