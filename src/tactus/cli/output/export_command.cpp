#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/run_flags.h"
#include "tactus/cli/viewed_scene.h"

namespace tactus {
namespace {

struct ExportFlags {
  RunOptions run;
  std::vector<std::string> formats;
  int every = 1;
};

/// Counts and names the new ones.
void print_files(const std::string& folder, std::filesystem::file_time_type begun) {
  std::vector<std::string> names;
  for (const auto& file : std::filesystem::directory_iterator(folder))
    if (file.is_regular_file() && file.last_write_time() >= begun &&
        file.path().filename().string()[0] != '.')
      names.push_back(file.path().string());
  std::sort(names.begin(), names.end());
  if (names.empty()) return;
  std::printf(
      "\nfiles: %s%s\n", names.front().c_str(),
      names.size() == 1 ? "" : (" to " + names.back() + " (" + std::to_string(names.size()) + ")").c_str());
}

void write_files(const ExportFlags& flags) {
  const RunOptions& options = flags.run;
  Scene scene = is_film(options.scene_path)
                    ? viewed_scene(options.scene_path, options.source_path, "none").scene
                    : scene_of(options);
  scene.source.plain = options.plain;
  scene.output = {};
  for (const std::string& format : flags.formats)
    (format == "usd"   ? scene.output.usd_every
     : format == "vtk" ? scene.output.vtk_every
                       : scene.output.mesh_every) = flags.every;
  const auto begun = std::filesystem::file_time_type::clock::now();
  run_scene(options, scene);
  print_files(options.out, begun);
}

}  // namespace

void add_export_command(CLI::App& app) {
  auto flags = std::make_shared<ExportFlags>();
  RunOptions& run = flags->run;
  run.view = "none";
  CLI::App* command = app.add_subcommand(
      "export", "Write a scene, a recording or a rig as files of other programs: USD, VTK, PLY");
  command->add_option("file", run.scene_path, "scene, recording (tactus run --record) or rig file")
      ->required();
  command
      ->add_option("--to", flags->formats,
                   "usd: one .usda of all that is seen (Blender, Omniverse); vtk: .vtu, .vtp and .pvd with "
                   "strain and stress (ParaView); ply: surfaces, a file each; or several, as usd,vtk")
      ->delimiter(',')
      ->check(CLI::IsMember({"usd", "vtk", "ply"}))
      ->required();
  command->add_option("--out", run.out, "folder of the files")->capture_default_str();
  command->add_option("--every", flags->every, "frames from one to the next that is written")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command->add_option("--frames", run.frames, "stop after so many frames; without it, at the source's end")
      ->check(CLI::Range(1, 999999999));
  add_devices(*command, run.devices);
  command->add_option("--source", run.source_path,
                      "a recording, or the rig file of live cameras, instead of the scene's source");
  command->add_option("--restart", run.restart_path, "begin after the last frame of a --checkpoint");
  command->add_option("--set", run.parameters,
                      "NAME=NUMBER: a parameter of the scene; may be given several times");
  command->add_flag("--plain", run.plain, "live cameras without keys, on this computer alone");
  command->footer(
      "Examples:\n  tactus export scenes/slice.yaml --to usd                 # out/slice.usda\n"
      "  tactus export scenes/liver.yaml --to vtk --every 5      # out/liver.pvd, for ParaView\n"
      "  tactus export touch.rec --to ply --out hull             # surfaces that its cameras saw\n"
      "  tactus export scenes/slice.yaml --to usd,ply --restart half.ckpt --frames 1\n"
      "Files are whole or not there: docs/results.md");
  command->callback([flags] { write_files(*flags); });
}

}  // namespace tactus
