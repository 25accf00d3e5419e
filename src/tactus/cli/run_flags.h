#pragma once
/// The flags of `tactus run`.
#include <string>
#include <vector>

#include "tactus/sim/scene.h"
#include "tactus/world/scene_parameters.h"

namespace CLI {
class App;
}

namespace tactus {

struct RunOptions {
  std::string scene_path, devices = "auto", out = "out", json_path, view = "file";
  std::string checkpoint_path, restart_path;
  std::string source_path, record_path;  ///< replaces the scene's source; gets its frames
  bool plain = false;                    ///< a live rig without keys
  std::string budget;                    ///< of a frame, as 11ms; "": none
  int frames = 0;                        ///< 0: all
  std::vector<int> moments;              ///< frames on the contact sheet, ascending; none: twelve
  bool explain = false;                  ///< where and why bodies are strained
  std::vector<std::string> contacts;     ///< bodies whose contacts are reported point by point
  bool shows_web = false;                ///< to browsers, while it runs
  std::string web, web_token, web_name;  ///< ADDR:PORT; a file; NAME:PORT
  std::string report_path;               ///< HTML
  bool web_control = false;              ///< browsers may pause, step, set parameters and hold tools
  std::size_t web_past_MB = 256;         ///< of frames that viewers saw
  std::vector<std::string> parameters;   ///< "NAME=VALUE": of the scene, from its first frame on
};

/// --web, which may have an address behind it. Keeps references.
void add_web_flag(CLI::App& command, bool& is_given, std::string& address, const std::string& meaning);
void add_run_flags(CLI::App& command, RunOptions& options);
/// The scene as the flags change it. @throws usage Error naming the flag that doesn't go with it.
Scene scene_of(const RunOptions& options);
/// Runs it to its end, and writes all files that the flags and `output` of the scene ask for.
void run_scene(const RunOptions& options, const Scene& scene);
/// @param settings "NAME=VALUE". @throws usage Error naming the one that is none, or that can't be set.
void set_parameters(SceneParameters& parameters, const std::vector<std::string>& settings);
/// Whether it writes files numbered or named by the scene, in a folder that no other run may write meanwhile.
bool writes_into_folder(const RunOptions& options, const Scene& scene);
/// The recording or live rig that replaces a scene's own source. @param flag before the message
SourceDescription source_of_file(const std::string& path, const std::string& flag);
/// "11ms" or "0.011s" in seconds; 0 for "". @throws usage Error naming the flag.
double parse_budget_s(const std::string& text);

}  // namespace tactus
