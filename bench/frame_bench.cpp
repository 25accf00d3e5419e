#include "bench.h"
#include "tactus/base/timing.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic_source.h"
#include "tactus/sim/simulation.h"

namespace tactus::bench {
/// scenes/demo.yaml (below the working directory), all frames of its four seconds.
Rows run_frame(const std::string& device_text) {
  const Scene scene = read_scene("scenes/demo.yaml");
  SyntheticOptions options;
  options.figure = scene.source.figure;
  options.shape = {.moving = scene.source.moving,
                   .scale = static_cast<float>(scene.source.scale),
                   .offset_m = vec_cast<float>(scene.source.offset_m)};
  options.depth = options.truth = false;
  options.frames = 120;
  SyntheticSource source(options);
  DeviceSet devices(device_text);
  Simulation simulation(devices, scene, source.rig(), {});
  FrameSet frame;
  for (double last_s = 0; source.next(frame) == NextFrame::success; last_s = frame.time_s) {
    check_stop();
    simulation.step(frame, frame.time_s - last_s);
  }
  const Timings& t = simulation.timings();
  nlohmann::json row{{"name", "demo frame"},
                     {"case", "hand"},
                     {"size", scene.reconstruction.resolution},
                     {"devices", devices.name()},
                     {"ms_p50", t.percentile_ms("frame", 50)},
                     {"ms_p99", t.percentile_ms("frame", 99)},
                     {"floor_ms", nullptr}};
  for (const std::string& stage : t.stages()) row["stages_ms_p50"][stage] = t.percentile_ms(stage, 50);
  row["kernels_ms_p50"] = kernels_ms(devices.context(0), [&] {
    for (int k = 0; k < 5; ++k) simulation.step(frame, 1.0 / 30);  // a few frames like the last
  });
  return {row};
}

}  // namespace tactus::bench
