#include "tactus/cli/commands.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/exit_codes.h"
#include "tactus/cli/frame_sources.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/live_source.h"
#include "tactus/cli/picture_thread.h"
#include "tactus/cli/program.h"
#include "tactus/cli/progress.h"
#include "tactus/cli/run_budget.h"
#include "tactus/cli/run_checkpoint.h"
#include "tactus/cli/run_explain.h"
#include "tactus/cli/run_report.h"
#include "tactus/cli/score_picture.h"
#include "tactus/fluid/liquid_mesh.h"
#include "tactus/io/body_assets.h"
#include "tactus/io/json_file.h"
#include "tactus/io/mesh_file.h"
#include "tactus/io/scene_file.h"
#include "tactus/io/vtk_file.h"
#include "tactus/rig/markers.h"
#include "tactus/rig/wire/recording_file.h"
#include "tactus/view/renderer.h"

namespace tactus {
namespace {

struct RunOptions {
  std::string scene_path, devices = "auto", out = "out", json_path, view = "file";
  std::string checkpoint_path, restart_path;
  std::string source_path, record_path;  ///< instead of the scene's source; what it saw
  bool plain = false;                    ///< a live rig without keys
  std::string budget;                    ///< of a frame; "": none
  int frames = 0;                        ///< 0: all
  bool explain = false;                  ///< where and why bodies are strained
};

/// Before the work: pictures are drawn with OpenGL, and not every machine has it.
void check_opengl() {
  if (const std::string why = Renderer::why_unavailable(); !why.empty())
    throw Error("--view file draws its pictures with OpenGL 4.5, which is not here: " + why +
                "; --view none runs the scene without pictures");
}

/// A run whose bodies were crushed says so at its end, where it is seen; one whose body blew up, by its exit
/// code, too.
void tell_of_strain(const RunSummary& summary, const Simulation& simulation, const RunOptions& options) {
  std::string names;
  for (std::size_t b = 0; b < simulation.bodies().size(); ++b) {
    const bool crushed = b < summary.least_volume.size() && summary.least_volume[b] < kBadVolume;
    if (simulation.bodies()[b]->is_stopped()) set_exit_code(kExitBlewUp);
    if (!crushed && !simulation.bodies()[b]->is_stopped()) continue;
    names += (names.empty() ? "'" : ", '") + simulation.bodies()[b]->name() + "'";
    names += simulation.bodies()[b]->is_stopped() ? " (blew up and rests)" : "";
  }
  if (names.empty() || options.explain) return;
  log_warning("crushed to less than " + number_text(kBadVolume) + " of their volume, or worse: " + names +
              "; 'tactus run " + options.scene_path +
              " --explain' says in which frames, where and what acts there");
}

void print_table(const Simulation& simulation) {
  std::printf("\n%-19s %10s %10s\n", "stage", "p50 [ms]", "p99 [ms]");
  for (const std::string& stage : simulation.timings().stages()) {
    std::printf("%-19s %10.3f %10.3f\n", stage.c_str(), simulation.timings().percentile_ms(stage, 50),
                simulation.timings().percentile_ms(stage, 99));
  }
}

/// The line that is written over and over: for people at a terminal who didn't ask for more, or less.
bool shows_progress() { return isatty(STDERR_FILENO) != 0 && log_level() == LogLevel::info; }

void show_progress(const std::string& text) {
  if (shows_progress()) std::fprintf(stderr, "\r%s\033[K", text.c_str());
}

/// How long the parts of a frame took.
std::string times_of(const StepReport& report, const Simulation& simulation, bool is_filmed) {
  const Timings& t = simulation.timings();
  char text[160] = "";
  if (is_filmed)
    std::snprintf(text, sizeof text, "hull %.1f ms   mesh %.1f ms   ", t.last_ms("hull"), t.last_ms("mesh"));
  const std::string hull = text;
  std::snprintf(text, sizeof text, "bodies %.1f ms (%d substeps)   frame %.1f ms", t.last_ms("bodies"),
                report.substeps, t.last_ms("frame"));
  return hull + text;
}

std::string numbered(std::int64_t tick, const char* extension) {
  char number[24];
  std::snprintf(number, sizeof number, "-%05lld%s", static_cast<long long>(tick), extension);
  return number;
}

void write_strains(Simulation& simulation, const std::string& stem, std::int64_t tick) {
  ExecContext& ctx = simulation.context();
  for (const auto& body : simulation.bodies())
    write_vtk(stem + "-" + body->name() + numbered(tick, ".vtk"), body->shape().lattice,
              body->positions_m(ctx), body->velocities_m_s(ctx), body->strains(ctx));
}

void write_meshes(const FrameSnapshot& snapshot, const Scene& scene, const std::string& stem,
                  std::int64_t tick) {
  const std::string ply = numbered(tick, ".ply");
  if (scene.source.kind != SourceKind::none) write_ply(stem + "-real" + ply, snapshot.real);
  for (std::size_t b = 0; b < snapshot.bodies.size(); ++b) {
    write_ply(stem + "-" + scene.bodies[b].name + ply, snapshot.bodies[b]);
  }
  if (scene.fluid)
    write_ply(stem + "-liquid" + ply,
              liquid_mesh(snapshot.liquid_m, static_cast<float>(scene.fluid->spacing_m)));
}

/// A scene that wants photographs gets them, or is told at its first frame: clay would look like a mistake in
/// the texture.
void check_photographs(const RunOptions& options, const Scene& scene, const FrameSet& frame) {
  if (scene.view.photographs == 0 || !frame.colors.empty()) return;
  const bool masks = scene.source.kind == SourceKind::masks;
  throw usage_error(
      options.scene_path + ": 'view.photographs' is " + std::to_string(scene.view.photographs) +
      ", but its source has no photographs" +
      (masks ? " for every camera: '" + scene.source.path + "' needs a 'photo' beside each 'mask'" : "") +
      "; expected 0 for a surface of clay");
}

/// Of the markers on its tools; nullptr: it has none.
const std::string* marker_dictionary_of(const Scene& scene) {
  for (const BladeDescription& blade : scene.blades)
    if (blade.tracked && !blade.tracked->markers.empty()) return &blade.tracked->dictionary;
  return nullptr;
}

/// Markers are seen in photographs.
void see_markers(const RunOptions& options, const Scene& scene, FrameSet& frame) {
  const std::string* dictionary = marker_dictionary_of(scene);
  if (dictionary == nullptr) return;
  if (frame.colors.empty())
    throw usage_error(options.scene_path +
                      ": a blade has 'markers', but its source has no photographs to see them in");
  frame.markers = find_markers(frame.colors, *dictionary);
}

/// Before anything is opened.
void check_markers(const RunOptions& options, const Scene& scene) {
  if (marker_dictionary_of(scene) == nullptr) return;
  if (!markers_missing().empty())
    throw Error(options.scene_path + ": a blade has 'markers', but " + markers_missing());
  if (!options.record_path.empty())
    throw usage_error(
        "--record '" + options.record_path +
        "': a blade of the scene has 'markers', and recordings keep photographs with losses, so it "
        "would not replay to the same bits");
}

/// What a scene is shown instead of its own source.
SourceDescription source_of_file(const std::string& path) {
  SourceDescription source;
  source.path = path;
  if (!std::filesystem::exists(path)) throw Error("--source '" + path + "': no such file");
  source.kind = is_recording(path) ? SourceKind::recording : SourceKind::live;
  return source;
}

/// Who takes part in a run besides its simulation; nullptr: not there.
struct RunCompany {
  PictureThread* pictures = nullptr;
  RecordingWriter* recorder = nullptr;
  RunBudget* budget = nullptr;
  std::string stem;  ///< of its files
};

/// Meshes and pictures of a frame.
void show_frame(const RunCompany& company, const Scene& scene, Simulation& simulation, const FrameSet& frame,
                bool is_new, const std::string& caption, bool keep_meshes) {
  if (company.pictures == nullptr && !keep_meshes) return;
  FrameSnapshot snapshot = simulation.snapshot();
  if (is_new) simulation.note_shown();
  if (keep_meshes) write_meshes(snapshot, scene, company.stem, frame.tick);
  if (company.pictures == nullptr) return;
  char time_text[32];
  std::snprintf(time_text, sizeof time_text, "%.2f s", frame.time_s);
  const bool with_photographs =
      scene.view.photographs > 0 && (company.budget == nullptr || !company.budget->leaves_out_photographs());
  company.pictures->add(std::move(snapshot), with_photographs ? frame.colors : std::vector<ColorImage>{},
                        caption, time_text);
}

/// The loop over frames.
RunSummary run_frames(const RunOptions& options, const Scene& scene, FrameSource& source,
                      Simulation& simulation, RunProgress& progress, const RunCompany& company) {
  RunSummary summary;
  std::optional<RunExplainer> explainer;
  if (options.explain) explainer.emplace(scene);
  FrameSet frame;
  const bool is_filmed = scene.source.kind != SourceKind::none;
  const double start_s = now_s();
  summary.note(source.damage());
  const std::optional<int> total =
      options.frames > 0 ? std::optional<int>(options.frames) : source.frame_count();
  while (!interrupted() && (options.frames == 0 || summary.frames < options.frames)) {
    const NextFrame next = source.next(frame);
    if (next == NextFrame::no_more_data) break;
    const double begin_s = now_s();
    if (company.recorder != nullptr) company.recorder->add(next, frame, source.status());
    ++progress.taken;
    if (is_filmed && next == NextFrame::nothing_new && !progress.has_last)
      continue;  // a live rig's first images
    if (summary.frames == 0 && next == NextFrame::success) check_photographs(options, scene, frame);
    summary.note(source.status());
    if (next == NextFrame::bad_frame) {
      ++summary.bad_frames;
      continue;
    }
    if (next == NextFrame::success) see_markers(options, scene, frame);
    const StepReport report = simulation.step(next == NextFrame::success ? &frame : nullptr,
                                              progress.has_time ? frame.time_s - progress.last_time_s : 0);
    progress.last_time_s = frame.time_s;
    progress.has_time = true;
    progress.has_last = is_filmed;
    summary.add(report);
    summary.add_strain(simulation);
    if (!scene.probes.empty()) summary.probes.push_back(simulation.probe_positions_m());
    if (!options.json_path.empty()) {
      summary.probe_strains.push_back(simulation.probe_strains());
      summary.monitors.push_back(simulation.monitors());
      summary.blades.push_back(simulation.tracked_blades().now());
      summary.motion_forces_N.push_back(simulation.motion_forces_N());
      summary.motion_torques_N_m.push_back(simulation.motion_torques_N_m());
    }
    if (explainer) explainer->add(report, simulation, frame.tick);
    const std::string times = times_of(report, simulation, is_filmed);
    const std::string caption = "frame " + std::to_string(frame.tick) + "   " + times;
    const bool keep_meshes = scene.output.mesh_every > 0 && !report.hull.overflow &&
                             (summary.frames - 1) % scene.output.mesh_every == 0;
    if (scene.output.vtk_every > 0 && (summary.frames - 1) % scene.output.vtk_every == 0)
      write_strains(simulation, company.stem, frame.tick);
    show_frame(company, scene, simulation, frame, next == NextFrame::success, caption, keep_meshes);
    if (company.budget != nullptr) {
      for (const Notice& notice :
           company.budget->add(frame.tick, now_s() - begin_s, next == NextFrame::success))
        summary.note(notice);
    }
    log_debug(caption);
    show_progress(progress_text(summary.frames, total, now_s() - start_s) + "   " + times);
  }
  for (const Notice& notice : simulation.last_notices()) summary.note(notice);
  if (company.budget != nullptr) {
    if (const std::optional<Notice> missed = company.budget->verdict()) summary.note(*missed);
  }
  if (shows_progress()) std::fputc('\n', stderr);
  if (explainer) explainer->finish();
  return summary;
}

void tell_of_bodies(const Simulation& simulation, bool with_devices) {
  for (const auto& body : simulation.bodies()) {
    log_debug("body '" + body->name() + "': " + std::to_string(body->node_count()) + " nodes, " +
              std::to_string(body->contact_point_count()) + " points for contact, " + body->devices_text());
    if (with_devices) std::printf("body '%s': %s\n", body->name().c_str(), body->devices_text().c_str());
  }
}

/// What needs cameras, of a scene that nobody films.
void check_filmed(const RunOptions& options, const Scene& scene) {
  if (scene.source.kind != SourceKind::none) return;
  const auto refuse = [](const std::string& what) {
    throw usage_error(what + " needs cameras, but 'source.kind' of the scene is none");
  };
  if (!options.record_path.empty()) refuse("--record '" + options.record_path + "'");
  if (!options.budget.empty()) refuse("--budget '" + options.budget + "'");
  if (scene.view.photographs > 0) refuse("'view.photographs'");
  for (const BladeDescription& blade : scene.blades)
    if (blade.tracked) refuse("blade '" + blade.name + "', which is tracked,");
}

Scene scene_of(const RunOptions& options) {
  Scene scene = read_scene(options.scene_path);
  if (!options.source_path.empty()) scene.source = source_of_file(options.source_path);
  scene.source.plain = options.plain;
  if (scene.source.kind == SourceKind::live && !options.restart_path.empty())
    throw usage_error("--restart '" + options.restart_path +
                      "' takes the frames so far again, which a live rig can't give; record the run "
                      "(--record FILE) and go on with --source FILE");
  check_filmed(options, scene);
  if (!options.budget.empty() && !(options.checkpoint_path.empty() && options.restart_path.empty()))
    throw usage_error("--budget '" + options.budget +
                      "' makes frames depend on how long they took, so a run can't go on with the same bits; "
                      "expected it without --checkpoint and --restart");
  return scene;
}

void write_results(const RunOptions& options, const RunSummary& summary, const Scene& scene,
                   const FrameSource& source, Simulation& simulation, const std::string& devices,
                   const RunBudget* budget) {
  nlohmann::json json = to_json(summary, scene, simulation, devices);
  json["state_hash"] = state_hash(simulation);
  if (const auto* live = dynamic_cast<const LiveSource*>(&source))
    json["live"] = nlohmann::json::parse(live_status_json(live->live_status()));
  if (budget != nullptr) json["budget"] = budget->to_json();
  write_json_file(options.json_path, json);
}

void run(const RunOptions& options) {
  const Scene scene = scene_of(options);
  std::optional<FolderLock> lock;
  if (options.view == "file" || scene.output.mesh_every > 0 || scene.output.vtk_every > 0 ||
      scene.output.trace)
    lock.emplace(options.out);
  if (!options.json_path.empty()) output_is_writable(options.json_path);
  if (!options.checkpoint_path.empty()) output_is_writable(options.checkpoint_path);
  check_markers(options, scene);
  DeviceSet devices(options.devices);
  const std::unique_ptr<FrameSource> source = open_frame_source(
      scene.source, {.colors = scene.view.photographs > 0 || marker_dictionary_of(scene) != nullptr,
                     .depth = scene.reconstruction.depth});
  const double budget_s = options.budget.empty() ? 0 : parse_budget_s(options.budget);
  const BodyAssets assets = load_body_assets(scene);
  Simulation simulation(devices, scene, source->rig(), assets, budget_s > 0);
  tell_of_bodies(simulation, options.explain && devices.count() > 1);

  const std::string stem =
      (std::filesystem::path(options.out) / std::filesystem::path(options.scene_path).stem()).string();
  std::optional<PictureThread> pictures;
  if (options.view == "file") check_opengl();
  if (options.view == "file")
    pictures.emplace([&] {
      return std::make_unique<RunPictures>(scene, source->rig(), assets, simulation, stem,
                                           std::clamp(source->fps().value_or(30), 1.0, 240.0));  // a film's
    });

  if (pictures && scene.view.show_models) pictures->show_models(element_triangles(simulation));

  RunProgress progress;
  if (!options.restart_path.empty())
    read_checkpoint(options.restart_path, options.scene_path, *source, progress, simulation);
  std::optional<RecordingWriter> recorder;
  if (!options.record_path.empty()) recorder.emplace(options.record_path, source->rig(), source->fps());
  std::optional<RunBudget> budget;
  if (budget_s > 0) budget.emplace(budget_s, simulation, pictures && scene.view.photographs > 0);
  const RunSummary summary = run_frames(
      options, scene, *source, simulation, progress,
      {pictures ? &*pictures : nullptr, recorder ? &*recorder : nullptr, budget ? &*budget : nullptr, stem});
  if (recorder) recorder->finish();
  if (!options.checkpoint_path.empty())
    write_checkpoint(options.checkpoint_path, options.scene_path, progress, simulation);
  if (summary.frames == 0 && !interrupted())
    throw Error("scene '" + scene.name + "': its source gave no usable frame: " + source->status());
  if (interrupted())
    log_info("interrupted: writing the results of " + std::to_string(summary.frames) + " frames");
  if (!source->damage().empty()) set_exit_code(kExitDamaged);
  if (pictures) pictures->finish();
  if (scene.output.trace) simulation.timings().write_trace(stem + "-trace.json");
  if (!options.json_path.empty())
    write_results(options, summary, scene, *source, simulation, devices.name(), budget ? &*budget : nullptr);
  std::printf("%s: %d frames on %s\n", scene.name.c_str(), summary.frames, devices.name().c_str());
  print_table(simulation);
  tell_of_strain(summary, simulation, options);
  if (pictures) std::printf("\npictures: %s.mp4, %s.png\n", stem.c_str(), stem.c_str());
  if (pictures && scene.output.score)
    for (const std::string& path : write_score_pictures(scene, simulation, stem))
      std::printf("score: %s\n", path.c_str());
  if (summary.open_frames > 0)
    throw Error(
        std::to_string(summary.open_frames) + " of " + std::to_string(summary.frames) +
        " frames had too little room for the real surface: it was open, and no mesh of it was written "
        "(the warnings above name the keys to raise)");
}

/// What is wrong with the number of frames; "" for nothing.
std::string a_frame_count(const std::string& text) {
  const bool whole = !text.empty() && text.size() < 10 && text.find_first_not_of("0123456789") == text.npos;
  if (whole && std::stoi(text) > 0) return "";
  return "'" + text +
         "', expected a whole number of frames, at least 1 (a range, as 5-9, is source.frames of the scene)";
}

}  // namespace

void add_run_command(CLI::App& app) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = app.add_subcommand("run", "Run a scene: cameras in, soft bodies pushed, pictures out");
  command->add_option("scene", options->scene_path, "scene file (docs/scene.md explains every key)")
      ->required();
  add_devices(*command, options->devices);
  command->add_option("--frames", options->frames, "stop after so many frames")->check(a_frame_count);
  command->add_option("--out", options->out, "folder of video, contact sheet, meshes and trace")
      ->capture_default_str();
  add_output(*command, "--json", options->json_path,
             "stage times, counters, monitors and probes as JSON (-: standard output)");
  command->add_flag(
      "--explain", options->explain,
      "say in which frames and where bodies are strained badly, what acts there, and what it costs");
  add_output(*command, "--checkpoint", options->checkpoint_path,
             "state after the last frame, interrupted or not, for --restart");
  command->add_option("--restart", options->restart_path,
                      "go on after the last frame of a --checkpoint, with the same bits as without a stop");
  command->add_option("--record", options->record_path,
                      "file to make: all that the source gives, with its times and cameras, for --source");
  command->add_option(
      "--source", options->source_path,
      "a recording (--record), or the rig file of live cameras, instead of the scene's source");
  command->add_option(
      "--budget", options->budget,
      "time of a frame, as 11ms: when frames take longer, less is done in them, with a notice, "
      "until they don't");
  command->add_flag("--plain", options->plain, "live cameras without keys, on this computer alone");
  command->add_option("--view", options->view, "file: video and contact sheet; none: no pictures")
      ->check(CLI::IsMember({"none", "file"}))
      ->capture_default_str();
  command->footer(
      "Examples:\n  tactus run scenes/demo.yaml\n  tactus run scenes/demo.yaml --devices cuda:0 --view none "
      "--json out/demo.json\n"
      "  tactus run my-scene.yaml --view none --explain        # a run went bad: where and why\n"
      "  tactus run my-scene.yaml --record touch.rec           # then: --source touch.rec, the same again");
  command->callback([options] { run(*options); });
}

}  // namespace tactus
