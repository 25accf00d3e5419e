#include "tactus/cli/commands.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/run_results.h"
#include "tactus/cli/run_web.h"
#include "tactus/geom/lattice/lattice_cut.h"
#include "tactus/io/scene_file.h"
#include "tactus/run/frame_loop.h"
#include "tactus/run/scene_source.h"
#include "tactus/sim/body/slab_points.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

/// Before the work: pictures are drawn with OpenGL, and not every machine has it.
void check_opengl() {
  if (const std::string why = Renderer::why_unavailable(); !why.empty())
    throw Error("--view file draws its pictures with OpenGL 4.5, which is not here: " + why +
                "; --view none runs the scene without pictures");
}

void print_bodies(const World& world, bool with_devices) {
  for (const auto& body : world.impl().bodies()) {
    log_debug("body '" + body->name() + "': " + std::to_string(nodes_in_use(body->shape().lattice)) +
              " nodes, " + std::to_string(body->points().count()) + " points for contact, " +
              body->devices_text());
    if (with_devices) std::printf("body '%s': %s\n", body->name().c_str(), body->devices_text().c_str());
  }
}

/// The sinks that write files or look for problems.
void open_sinks(const RunOptions& options, const Scene& scene, const FrameSource& source,
                const BodyAssets& assets, World& world, const std::string& stem, RunSinks& sinks) {
  if (!options.json_path.empty()) sinks.report.emplace(scene, options.contacts);
  for (const std::string& body : options.contacts) world.report_contacts(body);
  if (options.explain) sinks.explain.emplace(scene);
  const double frames_per_s = std::clamp(source.fps().value_or(30), 1.0, 240.0);  // a film's
  if (scene.output.vtk_every > 0) sinks.vtk.emplace(scene.output.vtk_every, stem);
  if (scene.output.usd_every > 0) sinks.usd.emplace(scene, assets, stem, frames_per_s);
  if (scene.output.mesh_every > 0) sinks.meshes.emplace(scene, stem);
  if (options.view == "file") {
    check_opengl();
    sinks.pictures.emplace(scene, source.rig(), assets, world, stem, frames_per_s, options.moments);
  }
  if (const double budget_s = parse_budget_s(options.budget); budget_s > 0) {
    sinks.budget.emplace(budget_s, world, sinks.pictures && scene.view.photographs > 0);
    if (sinks.pictures) sinks.pictures->follow(*sinks.budget);
  }
  sinks.progress.emplace(isatty(STDERR_FILENO) != 0 && log_level() == LogLevel::info);
}

/// @param web of all its runs; opened by the first. @returns whether a viewer wants it again from a frame of
/// the past.
bool run_once(const RunOptions& options, const Scene& scene, DeviceSet& devices,
              std::unique_ptr<WebSink>& web) {
  std::unique_ptr<FrameSource> source = open_scene_source(scene, options.scene_path);
  const BodyAssets assets = load_body_assets(scene);
  const auto perception =
      make_perception(devices, scene, source->rig(), assets, parse_budget_s(options.budget) > 0);
  World world(devices, scene, assets, perception.get());
  print_bodies(world, options.explain && devices.count() > 1);
  const std::string stem =
      (std::filesystem::path(options.out) / std::filesystem::path(options.scene_path).stem()).string();
  RunSinks sinks;
  open_sinks(options, scene, *source, assets, world, stem, sinks);
  RunProgress progress;
  const bool goes_back = web != nullptr;
  if (!options.restart_path.empty() && !goes_back)
    progress = read_checkpoint(options.restart_path, options.scene_path, *source, world);
  if (!goes_back) set_parameters(world.parameters(), options.parameters);
  RecordingFilter* recorder = nullptr;
  if (!options.record_path.empty()) {
    auto recorded = std::make_unique<RecordingFilter>(std::move(source), options.record_path);
    recorder = recorded.get();
    source = std::move(recorded);
  }
  if (!goes_back) web = open_web_sink(options, scene, source->rig(), assets, world, devices.name());
  const std::unique_ptr<ReplaySink> replay =
      open_replay_sink(options, scene, source->rig(), assets, devices.name());
  if (web) progress = web->begins_at(*source, world, options.scene_path, progress);
  const int before = web ? web->frames_before() : 0;
  const auto should_stop = [&] { return web ? web->wait_for_turn(interrupted) : interrupted(); };
  FrameLoop loop(
      *source, world,
      {.most_frames = options.frames > 0 ? options.frames - before : 0, .should_stop = should_stop});
  loop.go_on_from(progress);
  sinks.add_to(loop);
  if (replay) loop.add(*replay);
  if (web) web->join(loop, world);
  if (options.frames == 0 || options.frames > before) loop.run();
  if (recorder != nullptr) recorder->finish();
  if (replay)
    log_info("report: " + options.report_path + ", " + std::to_string(replay->frames()) + " frames, " +
             bytes_text(static_cast<double>(replay->bytes())));
  if (web && web->stay(interrupted)) return true;
  finish_run(options, scene, *source, world, loop, sinks, stem, devices.name());
  return false;
}

}  // namespace

bool writes_into_folder(const RunOptions& options, const Scene& scene) {
  return options.view == "file" || scene.output.mesh_every > 0 || scene.output.vtk_every > 0 ||
         scene.output.usd_every > 0 || scene.output.trace;
}

void run_scene(const RunOptions& options, const Scene& scene) {
  parse_budget_s(options.budget);  // before the work
  std::optional<FolderLock> lock;
  if (writes_into_folder(options, scene)) lock.emplace(options.out);
  if (!options.json_path.empty()) output_is_writable(options.json_path);
  if (!options.checkpoint_path.empty()) output_is_writable(options.checkpoint_path);
  DeviceSet devices(options.devices);
  std::unique_ptr<WebSink> web;
  while (run_once(options, scene, devices, web)) {
  }
}

void add_run_command(CLI::App& app) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "Run a scene: cameras in, soft bodies pushed, pictures out");
  add_run_flags(*command, *options);
  command->footer(
      "Examples:\n  tactus run scenes/demo.yaml\n  tactus run scenes/demo.yaml --devices cuda:0 --view none "
      "--json out/demo.json\n"
      "  tactus run my-scene.yaml --view none --explain        # a run went bad: where and why\n"
      "  tactus run my-scene.yaml --record touch.rec           # then: --source touch.rec, the same again");
  command->callback([options] { run_scene(*options, scene_of(*options)); });
}

}  // namespace tactus
