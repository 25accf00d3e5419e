#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/run_flags.h"
#include "tactus/cli/run_web.h"
#include "tactus/cli/viewed_scene.h"
#include "tactus/io/scene_file.h"
#include "tactus/run/frame_loop.h"
#include "tactus/run/scene_source.h"
#include "tactus/window/window.h"

namespace tactus {
namespace {

struct ViewFlags {
  std::string path, source_path, devices = "auto", size = "1280x720", tool = "auto";
  std::string web, budget;  ///< ADDR:PORT; time of a frame
  std::size_t past_MB = 256;
  bool plain = false, pause = false, no_panels = false, shows_web = false;
};

Vec2i parse_size(const std::string& text) {
  int width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 320 || height < 200 ||
      width > 8192 || height > 8192)
    throw usage_error("--size '" + text + "': expected pixels as 1280x720, 320x200 to 8192x8192");
  return {width, height};
}

/// The same scene and tools, in browsers.
void view_in_browsers(const ViewFlags& flags) {
  RunOptions options;
  options.shows_web = options.web_control = true;
  options.web = flags.web;
  options.web_past_MB = flags.past_MB;
  options.view = "none";
  ViewedScene viewed = viewed_scene(flags.path, flags.source_path, flags.tool);
  viewed.scene.source.plain = flags.plain;
  const Scene& scene = viewed.scene;
  DeviceSet devices(flags.devices);
  std::unique_ptr<WebSink> web;
  do {
    const std::unique_ptr<FrameSource> source = open_scene_source(scene, flags.path);
    const BodyAssets assets = load_body_assets(scene);
    const auto perception = make_perception(devices, scene, source->rig(), assets);
    World world(devices, scene, assets, perception.get());
    if (!web) web = open_web_sink(options, scene, source->rig(), assets, world, devices.name());
    FrameLoop loop(*source, world, {.should_stop = [&web] { return web->wait_for_turn(interrupted); }});
    loop.go_on_from(web->begins_at(*source, world, flags.path));
    web->join(loop, world);
    loop.run();
  } while (web->stay(interrupted));
}

void view(const ViewFlags& flags) {
  if (flags.shows_web) return view_in_browsers(flags);
  WindowOptions options;
  options.size_px = parse_size(flags.size);
  options.shows_panels = !flags.no_panels;
  options.should_close = interrupted;
  options.name = std::filesystem::path(flags.path).stem().string();
  if (const std::string missing = window_missing(); !missing.empty())
    throw Error("this build has no windows: " + missing + ", then build again");
  ViewedScene viewed = viewed_scene(flags.path, flags.source_path, flags.tool, true);
  viewed.scene.source.plain = flags.plain;
  options.is_paused = flags.pause;
  if (show_window(std::move(viewed.scene),
                  {.named = flags.path,
                   .devices = flags.devices,
                   .tools = viewed.tools,
                   .past_bytes = flags.past_MB * 1'000'000,
                   .budget_s = parse_budget_s(flags.budget)},
                  options))
    return;
  std::fflush(nullptr);
  std::_Exit(interrupted() ? 130 : 0);
}

}  // namespace

void add_view_command(CLI::App& app) {
  auto flags = std::make_shared<ViewFlags>();
  CLI::App* command = app.add_subcommand(
      "view", "Open a window on a running scene, a recording or a rig: orbit, pause, touch");
  command->add_option("file", flags->path, "scene, recording (tactus run --record) or rig file")->required();
  add_devices(*command, flags->devices);
  command->add_option("--source", flags->source_path,
                      "a recording, or the rig file of live cameras, instead of the scene's source");
  command->add_flag("--plain", flags->plain, "live cameras without keys, on this computer alone");
  command->add_option("--size", flags->size, "of the window in pixels")->capture_default_str();
  command
      ->add_option("--tool", flags->tool,
                   "what the mouse holds first: NAME of an obstacle or blade with 'held: true', ball, "
                   "hook, scalpel, none; auto: "
                   "the scene's first, or a ball and a hook, and a scalpel where bodies are cuttable")
      ->capture_default_str();
  add_web_flag(*command, flags->shows_web, flags->web,
               "no window: browsers show it at ADDR:PORT, by default 127.0.0.1:8090, and may touch it "
               "(docs/web.md)");
  command
      ->add_option("--past", flags->past_MB,
                   "most memory in MB for frames that were seen, to look at and to simulate again from")
      ->check(CLI::Range(0, 100000))
      ->capture_default_str();
  command->add_option("--budget", flags->budget,
                      "time that a frame should take, as 11ms: a mark at the bars of stages; by default the "
                      "time between the source's frames");
  command->add_flag("--pause", flags->pause, "begin with the first frame, paused");
  command->add_flag("--no-panels", flags->no_panels, "the picture alone; tab shows the panels");
  command->footer(
      "Examples:\n  tactus view scenes/demo.yaml\n  tactus view scenes/slice.yaml --web    # in a browser\n"
      "  tactus view touch.rec          # a recording: what its cameras saw\n  tactus view scenes/demo.yaml "
      "--source touch.rec\nKeys: h in the window shows them; "
      "docs/live_view.md");
  command->callback([flags] { view(*flags); });
}

}  // namespace tactus
