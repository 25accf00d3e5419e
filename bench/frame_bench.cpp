#include <cstdlib>
#include <random>

#include "bench.h"
#include "tactus/base/error.h"
#include "tactus/base/timing.h"
#include "tactus/io/body_assets.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic_source.h"
#include "tactus/sim/simulation.h"

namespace tactus::bench {
namespace {

struct FrameCase {
  const char* name;
  const char* scene;
  int resolution;
  int frames;
  double jitter_s;  ///< of the capture clock
};
constexpr FrameCase kCases[] = {{"demo frame", "demo", 100, 120, 0},
                                {"demo frame", "demo", 64, 120, 0},
                                {"demo frame, clock jitters", "demo", 64, 500, 0.01},
                                {"fig17 right frame", "fig17-hand", 64, 150, 0},
                                {"fig17 right frame", "fig17-hand", 100, 150, 0}};

SyntheticSource open_source(const SourceDescription& source, int frames) {
  SyntheticOptions options;
  options.figure = source.figure;
  options.shape = {.moving = source.moving,
                   .scale = static_cast<float>(source.scale),
                   .offset_m = vec_cast<float>(source.offset_m)};
  options.depth = options.truth = false;
  options.frames = frames;
  return SyntheticSource(options);
}

/// A frame's launches wait for one another, and a node of a graph takes that long on an H200. What they move
/// is no bound: the surface of 100^3 voxels and a body of 10,000 nodes are read in less than that.
constexpr double kGraphNode_ms = 0.0005;

nlohmann::json run_case(const FrameCase& c, const std::string& device_text) {
  Scene scene = read_scene(std::string("scenes/") + c.scene + ".yaml");
  scene.reconstruction.resolution = c.resolution;
  SyntheticSource source = open_source(scene.source, c.frames);
  DeviceSet devices(device_text);
  Simulation simulation(devices, scene, source.rig(), load_body_assets(scene));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter_s(-c.jitter_s, c.jitter_s);
  FrameSet frame;
  double last_s = 0;
  int substeps = 0;
  while (source.next(frame) == NextFrame::success) {
    check_stop();
    const double dt_s = frame.tick == 0 ? 0 : frame.time_s - last_s + (c.jitter_s > 0 ? jitter_s(random) : 0);
    last_s = frame.time_s;
    frame.captured_s = now_s();  // the masks are on the host now
    substeps = std::max(substeps, simulation.step(frame, dt_s).substeps);
  }
  const Timings& t = simulation.timings();
  nlohmann::json row{{"name", c.name},
                     {"case", scene.source.figure},
                     {"size", c.resolution},
                     {"devices", devices.name()},
                     {"ms_p50", t.percentile_ms("frame", 50)},
                     {"ms_p99", t.percentile_ms("frame", 99)},
                     {"substeps", substeps},
                     {"recordings", simulation.recordings()},
                     {"floor_ms", nullptr}};
  for (const std::string& stage : t.stages()) row["stages_ms_p50"][stage] = t.percentile_ms(stage, 50);
  const auto step = [&] { simulation.step(frame, 1.0 / 30); };
  row["launches"] = launches(devices.context(0), step);
  if (devices.device(0).is_cuda()) row["floor_ms"] = kGraphNode_ms * row["launches"].get<double>();
  row["kernels_ms_p50"] = kernels_ms(devices.context(0), [&] {
    for (int k = 0; k < 5; ++k) step();  // a few frames like the last
  });
  return row;
}

}  // namespace

/// Scenes below the working directory, all their frames: host masks to the surfaces on the device.
Rows run_frame(const std::string& device_text) {
  Rows rows;
  for (const FrameCase& c : kCases) rows.push_back(run_case(c, device_text));
  return rows;
}

}  // namespace tactus::bench
