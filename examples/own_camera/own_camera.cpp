// A camera of your own sends silhouettes, and a program of your own receives the sets.
//
// Here both are one program, without keys, as that is for one computer alone. To feed `tactus run SCENE
// --source rig.yaml` instead, leave the server out, take address, name and calibration of the rig file's
// camera, and read its key (read_live_key).
#include <cmath>
#include <cstdio>

#include "tactus/base/timing.h"
#include "tactus/rig/live.h"

using namespace tactus;

int main() {
  const Camera pinhole = look_at({0, 0.5, 2}, {0, 0.5, 0}, {0, 1, 0}, 320, 240, 300);
  const LiveCamera camera{"mine", {pinhole.width_px, pinhole.height_px}, calibration_hash(pinhole), false};
  LiveSettings settings;
  settings.address = "tcp://127.0.0.1:*";
  settings.sync = LiveSync::trigger;  // we number our images
  RigServer server({camera}, settings, std::nullopt);
  RigClient client(camera, server.address(), std::nullopt);

  LiveSet set;
  int received = 0;
  for (int tick = 0; tick < 10; ++tick) {
    CameraImages images;
    images.mask = BitMask(pinhole.width_px, pinhole.height_px);
    for (Index y = 0; y < 240; ++y) {
      for (Index x = 0; x < 320; ++x) {
        if (std::hypot(x - 100 - 10 * tick, y - 120) < 40) images.mask.set(x, y);
      }
    }
    client.put(images, tick, now_s());
    if (!server.wait(set, now_s() + 2)) continue;
    std::printf("tick %lld: %lld pixels, %.2f ms after the capture\n", static_cast<long long>(set.tick),
                static_cast<long long>(set.images[0].mask.area_px()),
                1e3 * (set.released_s - set.captured_s));
    ++received;
  }
  return received >= 9 ? 0 : 1;
}
