#include "tactus/cli/run_flags.h"

#include <charconv>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/cli/commands.h"
#include "tactus/io/scene_file.h"
#include "tactus/rig/wire/recording_file.h"
#include "tactus/run/scene_source.h"

namespace tactus {
namespace {

/// Refuses options that need cameras where the scene has no source of images.
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

/// Recordings keep photographs with losses.
void check_recorded(const RunOptions& options, const Scene& scene) {
  if (options.record_path.empty() || !has_markers(scene)) return;
  throw usage_error("--record '" + options.record_path +
                    "': a blade of the scene has 'markers', and recordings keep photographs with losses, so "
                    "it would not replay to the same bits");
}

/// Refuses moments that come twice or before others, and those for which there is no contact sheet.
void check_moments(const RunOptions& options, const Scene& scene) {
  if (options.moments.empty()) return;
  const auto name = [](int moment) { return "--moments: " + std::to_string(moment); };
  for (std::size_t i = 0; i < options.moments.size(); ++i) {
    const int moment = options.moments[i], before = i == 0 ? -1 : options.moments[i - 1];
    if (moment <= before)
      throw usage_error(name(moment) + ", expected a frame of " + std::to_string(before + 1) + " or later");
    if (options.frames > 0 && moment >= options.frames)
      throw usage_error(name(moment) + " comes after the last of --frames " + std::to_string(options.frames));
  }
  if (options.view != "file" || !scene.output.contact_sheet)
    throw usage_error(name(options.moments.front()) +
                      " is for the contact sheet: expected --view file, and 'output.contact_sheet' of the "
                      "scene not false");
}

void check_web(const RunOptions& options) {
  const bool keeps_past = options.web_past_MB != RunOptions().web_past_MB;
  if (options.shows_web && keeps_past && !options.web_control)
    throw usage_error("--web-past goes with --web-control, which is not given");
  if (options.shows_web) return;
  for (const auto& [flag, is_given] :
       {std::pair{"--web-control", options.web_control}, std::pair{"--web-token", !options.web_token.empty()},
        std::pair{"--web-name", !options.web_name.empty()}, std::pair{"--web-past", keeps_past}})
    if (is_given) throw usage_error(std::string(flag) + " goes with --web, which is not given");
}

/// Refuses a file that would be written twice, or over the run's own input. (RecordingFilter sees to
/// --record.)
void check_files(const RunOptions& options) {
  struct Named {
    const char* flag;
    std::string path;
  };
  const Named outputs[] = {{"--json", options.json_path},
                           {"--report", options.report_path},
                           {"--checkpoint", options.checkpoint_path}};
  std::vector<Named> taken{{"the scene", options.scene_path}, {"--source", options.source_path}};
  for (const Named& output : outputs) {
    if (output.path.empty() || output.path == "-") continue;
    std::error_code no_such;
    const auto path = std::filesystem::weakly_canonical(output.path, no_such);
    if (std::filesystem::exists(path, no_such) && !std::filesystem::is_regular_file(path, no_such))
      continue;  // a device takes all of them
    for (const Named& other : taken)
      if (!other.path.empty() && std::filesystem::weakly_canonical(other.path, no_such) == path)
        throw usage_error(std::string(output.flag) + " '" + output.path + "' is " + other.flag +
                          "'s file, too: expected a file of its own");
    taken.push_back(output);
  }
}

/// The error in a number of frames; "" for none.
std::string a_frame_count(const std::string& text) {
  const bool whole = !text.empty() && text.size() < 10 && text.find_first_not_of("0123456789") == text.npos;
  if (whole && std::stoi(text) > 0) return "";
  return "'" + text +
         "', expected a whole number of frames, 1 to 999999999 (a range, as 5-9, is source.frames of the "
         "scene)";
}

void add_web_flags(CLI::App& command, RunOptions& options) {
  add_web_flag(command, options.shows_web, options.web,
               "show the run to browsers at ADDR:PORT, by default 127.0.0.1:8090 (docs/web.md)");
  command.add_flag("--web-control", options.web_control,
                   "viewers may pause, step, change parameters, hold tools and grab tissue");
  command.add_option("--web-token", options.web_token,
                     "file with the word that viewers must know; without it, one is made where it is needed");
  command.add_option("--web-name", options.web_name,
                     "NAME:PORT at which a TLS server of yours passes viewers on (docs/web.md)");
  command
      .add_option("--web-past", options.web_past_MB,
                  "most memory in MB for frames that viewers may go back to, with --web-control; 0: none")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
}

}  // namespace

void add_web_flag(CLI::App& command, bool& is_given, std::string& address, const std::string& meaning) {
  command
      .add_option_function<std::vector<std::string>>(
          "--web",
          [&is_given, &address](const std::vector<std::string>& words) {
            is_given = true;
            address = words.empty() ? "" : words.front();
          },
          meaning)
      ->expected(0, 1)
      ->type_name("[ADDR:PORT]");
}

SourceDescription source_of_file(const std::string& path, const std::string& flag) {
  SourceDescription source;
  source.path = path;
  if (!std::filesystem::exists(path)) throw Error(flag + "'" + path + "': no such file");
  source.kind = is_recording(path) ? SourceKind::recording : SourceKind::live;
  return source;
}

Scene scene_of(const RunOptions& options) {
  check_files(options);
  Scene scene = read_scene(options.scene_path);
  if (!options.source_path.empty()) scene.source = source_of_file(options.source_path, "--source ");
  scene.source.plain = options.plain;
  if (scene.source.kind == SourceKind::live && !options.restart_path.empty())
    throw usage_error("--restart '" + options.restart_path +
                      "' takes the frames so far again, which a live rig can't give; record the run "
                      "(--record FILE) and go on with --source FILE");
  check_web(options);
  check_moments(options, scene);
  check_filmed(options, scene);
  check_recorded(options, scene);
  if (!options.budget.empty() && !(options.checkpoint_path.empty() && options.restart_path.empty()))
    throw usage_error("--budget '" + options.budget +
                      "' makes frames depend on how long they took, so a run can't go on with the same bits; "
                      "expected it without --checkpoint and --restart");
  if (!options.contacts.empty() && options.json_path.empty())
    throw usage_error("--contacts '" + options.contacts.front() +
                      "' writes into the JSON of the run: expected it with --json FILE");
  return scene;
}

void set_parameters(SceneParameters& parameters, const std::vector<std::string>& settings) {
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    double value = 0;
    const char* const end = setting.data() + setting.size();
    if (equals != setting.npos) {
      const auto [read_to, error] = std::from_chars(setting.data() + equals + 1, end, value);
      if (error == std::errc() && read_to == end) {
        parameters.set(setting.substr(0, equals), value);
        continue;
      }
    }
    throw usage_error(
        "--set '" + setting +
        "': expected NAME=NUMBER, as contact.friction=0.6; 'tactus info --parameters SCENE' lists "
        "the names");
  }
}

double parse_budget_s(const std::string& text) {
  if (text.empty()) return 0;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  const double seconds = unit == "s" ? value : 1e-3 * value;
  const bool is_known = unit == "ms" || unit == "s";  // a bare 11 may be meant as either
  if (error != std::errc() || !is_known || !(seconds >= 1e-4 && seconds <= 10))
    throw usage_error("--budget '" + text +
                      "': expected the time of a frame with its unit, as 11ms or 0.011s, 0.1 ms to 10 s");
  return seconds;
}

void add_run_flags(CLI::App& command, RunOptions& options) {
  command.add_option("scene", options.scene_path, "scene file (docs/scene.md explains every key)")
      ->required();
  add_devices(command, options.devices);
  command.add_option("--frames", options.frames, "stop after so many frames")->check(a_frame_count);
  command
      .add_option("--moments", options.moments,
                  "frames on the contact sheet in place of twelve, as 6,12,60; the first is 0, and one alone "
                  "fills it")
      ->delimiter(',');
  command.add_option("--out", options.out, "folder of video, contact sheet, meshes and trace")
      ->capture_default_str();
  add_output(command, "--json", options.json_path,
             "stage times, counters, monitors and probes as JSON (-: standard output)");
  command.add_option("--contacts", options.contacts,
                     "body whose contacts --json writes point by point; may be given several times");
  command.add_option("--set", options.parameters,
                     "NAME=NUMBER: a parameter of the scene, as contact.friction=0.6; may be given several "
                     "times; info --parameters lists them");
  command.add_flag(
      "--explain", options.explain,
      "say in which frames and where bodies are strained badly, what acts there, and what it costs");
  add_output(command, "--checkpoint", options.checkpoint_path,
             "state after the last frame, interrupted or not, for --restart");
  command.add_option("--restart", options.restart_path,
                     "go on after the last frame of a --checkpoint, with the same bits as without a stop");
  command.add_option("--record", options.record_path,
                     "file to make: all that the source gives, with its times and cameras, for --source");
  command.add_option(
      "--source", options.source_path,
      "a recording (--record), or the rig file of live cameras, instead of the scene's source");
  command.add_option(
      "--budget", options.budget,
      "time of a frame, as 11ms: when frames take longer, less is done in them, with a notice, "
      "until they don't");
  add_web_flags(command, options);
  add_output(command, "--report", options.report_path,
             "HTML file to make: the run in 3D, its times and notices, to open without a network");
  command.add_flag("--plain", options.plain, "live cameras without keys, on this computer alone");
  command
      .add_option("--view", options.view,
                  "file: video and contact sheet; none: no pictures; a window: tactus view")
      ->check(CLI::Validator(
          [](const std::string& view) {
            if (view == "none" || view == "file") return std::string();
            return "'" + view +
                   "', expected none or file; `tactus view SCENE` opens a window, --web shows the run in a "
                   "browser";
          },
          "{none,file}"))
      ->capture_default_str();
}

}  // namespace tactus
