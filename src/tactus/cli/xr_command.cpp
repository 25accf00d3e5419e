#include <cmath>
#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/viewed_scene.h"
#include "tactus/xr/headset.h"

namespace tactus {
namespace {

struct XrFlags {
  std::string path, source_path, devices = "auto", at = "0,1,-0.55", tool = "auto";
  bool plain = false;
};

Vec3d parse_place(const std::string& text) {
  Vec3d at{};
  char rest = 0;
  if (std::sscanf(text.c_str(), "%lf,%lf,%lf%c", &at.x, &at.y, &at.z, &rest) != 3 ||
      !(std::abs(at.x) <= 100 && std::abs(at.y) <= 100 && std::abs(at.z) <= 100))
    throw usage_error("--at '" + text + "': expected metres as 0,1,-0.55, each within 100");
  return at;
}

void show(const XrFlags& flags) {
  HeadsetOptions options;
  options.at_m = parse_place(flags.at);
  options.named = flags.path;
  options.devices = flags.devices;
  options.should_close = interrupted;
  if (const std::string missing = headset_missing(); !missing.empty())
    throw Error("this build knows no headsets: " + missing + ", then build again");
  ViewedScene viewed = viewed_scene(flags.path, flags.source_path, flags.tool);
  viewed.scene.source.plain = flags.plain;
  show_in_headset(std::move(viewed.scene), options);
}

}  // namespace

void add_xr_command(CLI::App& app) {
  auto flags = std::make_shared<XrFlags>();
  CLI::App* command =
      app.add_subcommand("xr", "Show a running scene in a headset, by OpenXR: controllers hold its tools");
  command->add_option("file", flags->path, "scene, recording (tactus run --record) or rig file")->required();
  add_devices(*command, flags->devices);
  command->add_option("--source", flags->source_path,
                      "a recording, or the rig file of live cameras, instead of the scene's source");
  command->add_flag("--plain", flags->plain, "live cameras without keys, on this computer alone");
  command
      ->add_option(
          "--at", flags->at,
          "where the middle of the scene's picture lies in the room [m]: right, above the floor, back")
      ->capture_default_str();
  command
      ->add_option("--tool", flags->tool,
                   "what hands may take, as for tactus view: auto, ball, hook, scalpel, none, or the name of "
                   "a held thing")
      ->capture_default_str();
  command->footer(
      "Examples:\n  tactus xr scenes/poke.yaml\n  tactus xr scenes/poke.yaml --at 0,0.8,-0.4\n"
      "A runtime must be there, as Monado is; docs/live_view.md");
  command->callback([flags] { show(*flags); });
}

}  // namespace tactus
