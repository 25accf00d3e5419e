#include "tactus/cli/run_results.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/cli/exit_codes.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/output/score_picture.h"
#include "tactus/cli/program.h"
#include "tactus/cli/version.h"
#include "tactus/io/json_file.h"
#include "tactus/run/frame_loop.h"
#include "tactus/world/world.h"
#include "tactus/world/world_impl.h"

namespace tactus {
namespace {

/// A run whose bodies were crushed says so at its end, where it is seen; one whose body blew up, by its exit
/// code, too.
void warn_of_strain(const CrushSink& crush, World& world, const RunOptions& options) {
  std::string names;
  const std::vector<BodyMonitors> last = world.monitors();
  for (std::size_t b = 0; b < world.impl().bodies().size(); ++b) {
    const SoftBody& body = *world.impl().bodies()[b];
    if (body.status().is_frozen) set_exit_code(kExitBlewUp);
    // Devices look at elements while they step; cubes whose shape is matched are seen here, as they end.
    const bool ends_crushed = last[b].inverted_cubes > 0 || last[b].min_J < kBadVolume;
    if (!crush.is_crushed(b) && !ends_crushed && !body.status().is_frozen) continue;
    names += (names.empty() ? "'" : ", '") + body.name() + "'";
    names += body.status().is_frozen ? " (blew up and rests)" : "";
  }
  if (names.empty() || options.explain) return;
  log_warning("crushed to less than " + number_text(kBadVolume) + " of their volume, or worse: " + names +
              "; 'tactus run " + options.scene_path +
              " --explain' says in which frames, where and what acts there");
}

void print_table(const World& world) {
  std::printf("\n%-19s %10s %10s\n", "stage", "p50 [ms]", "p99 [ms]");
  for (const std::string& stage : world.timings().stages()) {
    std::printf("%-19s %10.3f %10.3f\n", stage.c_str(), world.timings().percentile_ms(stage, 50),
                world.timings().percentile_ms(stage, 99));
  }
}

void write_report(const RunOptions& options, const ReportSink& report, const FrameLoop& loop,
                  const FrameSource& source, World& world, const std::string& devices,
                  const BudgetSink* budget) {
  nlohmann::json json = report.to_json(loop, world, devices);
  json["commit"] = commit_text();
  json["state_hash"] = state_hash(world);
  if (const std::string links = source.links_json(); !links.empty())
    json["live"] = nlohmann::json::parse(links);
  if (budget != nullptr) json["budget"] = budget->to_json();
  write_json_file(options.json_path, json);
}

}  // namespace

void finish_run(const RunOptions& options, const Scene& scene, const FrameSource& source, World& world,
                const FrameLoop& loop, RunSinks& sinks, const std::string& stem, const std::string& devices) {
  if (!options.checkpoint_path.empty())
    write_checkpoint(options.checkpoint_path, options.scene_path, loop.progress(), world);
  if (loop.frames() == 0 && !interrupted() && !options.restart_path.empty() && loop.progress().taken > 0)
    throw Error("scene '" + scene.name + "': its frames end where '" + options.restart_path +
                "' was written: nothing is left to run");
  if (loop.frames() == 0 && !interrupted())
    throw Error("scene '" + scene.name + "': its source gave no usable frame: " +
                (source.status().empty() ? "no camera sent images" : source.status()));
  if (interrupted())
    log_info("interrupted: writing the results of " + std::to_string(loop.frames()) + " frames");
  if (!source.damage().empty()) set_exit_code(kExitDamaged);
  if (sinks.pictures) sinks.pictures->finish();
  if (scene.output.trace) world.timings().write_trace(stem + "-trace.json");
  if (sinks.report)
    write_report(options, *sinks.report, loop, source, world, devices,
                 sinks.budget ? &*sinks.budget : nullptr);
  std::printf("%s: %d frames on %s\n", scene.name.c_str(), loop.frames(), devices.c_str());
  print_table(world);
  warn_of_strain(sinks.crush, world, options);
  if (sinks.pictures && (scene.output.video || scene.output.contact_sheet))
    std::printf("\npictures: %s%s%s\n", scene.output.video ? (stem + ".mp4").c_str() : "",
                scene.output.video && scene.output.contact_sheet ? ", " : "",
                scene.output.contact_sheet ? (stem + ".png").c_str() : "");
  if (sinks.pictures && scene.output.score)
    for (const std::string& path : write_score_pictures(scene, world, stem))
      std::printf("score: %s\n", path.c_str());
  if (loop.open_frames() > 0)
    throw Error(
        std::to_string(loop.open_frames()) + " of " + std::to_string(loop.frames()) +
        " frames had too little capacity for the real surface: it was open, and no mesh of it was written "
        "(the warnings above name the keys to raise)");
}

}  // namespace tactus
