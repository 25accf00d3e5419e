#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <span>

#include "bench.h"
#include "tactus/base/error.h"
#include "tactus/base/timing.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/world/world.h"
#include "tactus/world/world_impl.h"

namespace tactus::bench {
namespace {

struct FrameCase {
  const char* name;
  const char* scene;
  int resolution;
  int frames;
  double jitter_s;         ///< of the capture clock
  int pool_particles = 0;  ///< what lies on the floor of the liquid's box, closed then
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
  options.first_frame = source.frames.first;
  options.frames = frames;
  return SyntheticSource(options);
}

/// A frame's launches wait for one another, and a node of a graph takes that long on an H200. What they move
/// is no bound: the surface of 100^3 voxels and a body of 10,000 nodes are read in less than that.
constexpr double kGraphNode_ms = 0.0005;

struct FrameTime {
  double ms = 0;
  std::int64_t tick = 0;
  int substeps = 0;
  nlohmann::json stages_ms;
};

FrameTime last_frame(const Timings& timings, std::int64_t tick, int substeps) {
  FrameTime frame{timings.last_ms("frame"), tick, substeps, {}};
  for (const std::string& stage : timings.stages()) frame.stages_ms[stage] = timings.last_ms(stage);
  return frame;
}

/// Of the frames, had the liquid made one step in each, as in the paper: its other steps, of equal length,
/// are taken off. Such a liquid is slower than all else by the number of steps.
double one_liquid_step_ms(std::span<const FrameTime> frames) {
  std::vector<double> ms;
  for (const FrameTime& f : frames)
    ms.push_back(f.ms - f.stages_ms.value("liquid", 0.0) * (1 - 1.0 / f.substeps));
  return percentile(ms, 50);
}

/// A block of about so many particles at the floor, as wide as the box and as deep as full layers need.
void add_pool(LiquidDescription& liquid, int particles) {
  const double d_m = liquid.spacing_m;
  const Vec3d size_m = liquid.box.max_m - liquid.box.min_m;
  const double layers = std::ceil(particles * d_m * d_m / (size_m.x * size_m.z));
  BoxRegion pool{liquid.box.min_m, liquid.box.max_m};
  pool.max_m.y = pool.min_m.y + (layers + 0.01) * d_m;  // rounding must not take a layer
  pool.max_m.z = pool.min_m.z + particles * d_m * d_m * d_m / (layers * d_m * size_m.x);
  liquid.open = LiquidOpen::none;
  liquid.film = false;  // which would take the lowest layers: these rows tell what particles cost
  liquid.blocks.push_back({pool, {}});
  liquid.max_particles = std::max(liquid.max_particles, 2 * particles);
}

nlohmann::json run_case(const FrameCase& c, const std::string& device_text) {
  Scene scene = read_scene(std::string("scenes/") + c.scene + ".yaml");
  scene.reconstruction.resolution = c.resolution;
  if (c.pool_particles > 0) add_pool(scene.fluid.value(), c.pool_particles);
  SyntheticSource source = open_source(scene.source, c.frames);
  DeviceSet devices(device_text);
  const BodyAssets assets = load_body_assets(scene);
  Perception perception(devices, scene, source.rig(), assets);
  World world(devices, scene, assets, &perception);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> jitter_s(-c.jitter_s, c.jitter_s);
  FrameSet frame;
  double last_s = 0;
  bool is_first = true;  // its tick is not 0 where a film begins later
  int substeps = 0;
  double simulated_s = 0, wall_s = 0;
  double first_ms = 0;  // of the frame that simulates nothing: bodies settle, and tools are looked for
  std::vector<FrameTime> frames;
  while (source.next(frame) == NextFrame::success) {
    check_stop();
    const double dt_s = is_first ? 0 : frame.time_s - last_s + (c.jitter_s > 0 ? jitter_s(random) : 0);
    last_s = frame.time_s;
    is_first = false;
    frame.captured_s = now_s();  // the masks are on the host now
    world.set_surface(perception.observe(&frame, dt_s));
    const StepReport report = world.step(dt_s);
    const int count = report.substeps;
    substeps = std::max(substeps, count);
    simulated_s += report.dt_s;
    wall_s += report.dt_s > 0 ? 1e-3 * world.timings().last_ms("frame") : 0;
    if (count > 0)
      frames.push_back(last_frame(world.timings(), frame.tick, count));
    else
      first_ms = std::max(first_ms, world.timings().last_ms("frame"));
  }
  const Timings& t = world.timings();
  std::vector<double> frame_ms;
  for (const FrameTime& f : frames) frame_ms.push_back(f.ms);
  nlohmann::json row{{"name", c.name},
                     {"case", scene.source.figure},
                     {"size", c.resolution},
                     {"devices", devices.name()},
                     {"ms_p50", percentile(frame_ms, 50)},
                     {"ms_p99", percentile(frame_ms, 99)},
                     {"first_frame_ms", first_ms},
                     {"substeps", substeps},
                     {"recordings", world.impl().schedule().recordings()},
                     {"real_time_factor", simulated_s / wall_s},
                     {"floor_ms", nullptr}};
  if (world.impl().liquid() != nullptr) {
    row["particles"] = world.snapshot().liquid_m.size();
    row["ms_p50_one_liquid_step"] = one_liquid_step_ms(frames);
  }
  for (const std::string& stage : t.stages()) row["stages_ms_p50"][stage] = t.percentile_ms(stage, 50);
  const std::size_t slow = std::min<std::size_t>(5, frames.size());
  std::partial_sort(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(slow), frames.end(),
                    [](const FrameTime& a, const FrameTime& b) { return a.ms > b.ms; });
  for (std::size_t i = 0; i < slow; ++i)
    row["slowest"].push_back({{"ms", frames[i].ms},
                              {"tick", frames[i].tick},
                              {"substeps", frames[i].substeps},
                              {"stages_ms", frames[i].stages_ms}});
  const auto step = [&] {
    world.set_surface(perception.observe(&frame, 1.0 / 30));
    world.step(1.0 / 30);
  };
  row["launches"] = launches(devices.context(0), step);
  if (devices.device(0).is_cuda()) row["floor_ms"] = kGraphNode_ms * row["launches"].get<double>();
  row["kernels_ms_p50"] = kernels_ms(devices.context(0), [&] {
    for (int k = 0; k < 5; ++k) step();  // a few frames like the last
  });
  return row;
}

}  // namespace

/// Milliseconds that the paper states for a whole frame, on its CPU and on six of its GPUs, and for one GPU
/// of its reference 14.
struct PaperFrame {
  const char* scene;
  int resolution, frames;
  double cpu_ms, gpus_ms, gpu_ms;
  double on(const DeviceSet& devices) const {
    return !devices.is_cuda() ? cpu_ms : devices.count() > 1 ? gpus_ms : gpu_ms;
  }
};
constexpr PaperFrame kTable5[] = {
    {"fig17-rabbit", 64, 120, 275.6, 37.4, 56.3},    {"fig17-hand", 64, 120, 275.6, 37.4, 56.3},
    {"fig18-scalpel", 64, 90, 350.4, 43.2, 65.4},    {"fig19-bleeding", 64, 90, 392.5, 45.6, 67.8},
    {"fig17-rabbit", 100, 120, 995.0, 78.5, 96.5},   {"fig17-hand", 100, 120, 995.0, 78.5, 96.5},
    {"fig18-scalpel", 100, 90, 1278.6, 92.3, 111.7}, {"fig19-bleeding", 100, 90, 1563.5, 103.8, 125.6}};
/// The wound of Fig 19 gives off some hundred particles where the paper's has 40,000: more of them lie below.
constexpr int kPools[] = {2000, 40000, 200000};
constexpr int kMostOnCpu = 40000;

/// Scenes below the working directory, all their frames: host masks to the surfaces on the device.
Rows run_frame(const std::string& device_text) {
  Rows rows;
  for (const FrameCase& c : kCases)
    if (is_wanted(c.scene)) rows.push_back(run_case(c, device_text));
  return rows;
}

void run_pools(const std::string& device_text, Rows& rows) {
  const bool on_gpu = DeviceSet(device_text).is_cuda();
  for (const int particles : kPools) {
    if (!is_wanted("fig19-pool") || (!on_gpu && particles > kMostOnCpu)) continue;
    nlohmann::json row = run_case({"table5", "fig19-bleeding", 64, 90, 0, particles}, device_text);
    row["case"] = "fig19-pool " + std::to_string(particles);
    rows.push_back(row);
  }
}

/// Table 5 of Shao et al. 2019: Fig 17, both examples, 18 and 19. All frames of the scenes. And Fig 19 above
/// a pool.
Rows run_table5(const std::string& device_text) {
  return collect([&](Rows& rows) {
    for (const PaperFrame& paper : kTable5) {
      if (!is_wanted(paper.scene)) continue;
      nlohmann::json row = run_case({"table5", paper.scene, paper.resolution, paper.frames, 0}, device_text);
      const double paper_ms = paper.on(DeviceSet(device_text));
      row["case"] = paper.scene;
      row["reference"] = {{"paper", paper_ms},
                          {"paper_cpu", paper.cpu_ms},
                          {"paper_six_gpus", paper.gpus_ms},
                          {"paper_one_gpu", paper.gpu_ms}};
      row["paper_over_ours"] = paper_ms / row["ms_p50"].get<double>();
      rows.push_back(row);
    }
    run_pools(device_text, rows);
  });
}

}  // namespace tactus::bench
