#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/info_file.h"
#include "tactus/cli/version.h"
#include "tactus/compute/device.h"
#include "tactus/io/json_file.h"
#include "tactus/io/scene_file.h"
#include "tactus/media/picture.h"
#include "tactus/rig/background/background_model.h"
#include "tactus/rig/calibration_files/calibration_file.h"
#include "tactus/rig/live/live_keys.h"
#include "tactus/rig/picture_reader.h"
#include "tactus/rig/wire/photo_coder.h"
#include "tactus/run/frame_sources.h"
#include "tactus/view/renderer.h"
#include "tactus/web/web_files.h"
#include "tactus/web/web_server.h"
#include "tactus/window/window.h"
#include "tactus/world/world.h"
#include "tactus/world/world_impl.h"
#include "tactus/xr/headset.h"

namespace tactus {
namespace {

void info(const std::string& json_path) {
  if (!json_path.empty()) output_is_writable(json_path);
  nlohmann::json json{
      {"version", version_text()}, {"cuda", cuda_status_text()}, {"devices", nlohmann::json::array()}};
  std::printf("%s\n\n", version_text().c_str());
  for (const DeviceInfo& d : list_devices()) {
    const bool gpu = d.spec.kind == DeviceKind::cuda;
    const std::string name = gpu ? "cuda:" + std::to_string(d.spec.ordinal) : "cpu";
    std::string peers;
    for (const int p : d.peer_ordinals) peers += " cuda:" + std::to_string(p);
    std::printf("%-8s %-40s %10s  %d %s%s\n", name.c_str(), d.name.c_str(),
                bytes_text(d.memory_bytes).c_str(), d.multiprocessors, gpu ? "multiprocessors" : "cores",
                peers.empty() ? "" : ("  peers:" + peers).c_str());
    if (gpu) std::printf("%-8s %s: %s\n", "", d.usable ? "usable" : "NOT USABLE", d.code.c_str());
    json["devices"].push_back({{"name", name},
                               {"model", d.name},
                               {"memory_bytes", d.memory_bytes},
                               {"multiprocessors", d.multiprocessors},
                               {"peers", d.peer_ordinals}});
    if (gpu)
      json["devices"].back().update({{"capability", d.capability}, {"code", d.code}, {"usable", d.usable}});
  }
  const std::string no_gl = Renderer::why_unavailable();
  const std::string gl =
      no_gl.empty() ? Renderer({.width_px = 16, .height_px = 16}).description() : "none: " + no_gl;
  std::printf("\nCUDA     %s\nOpenGL   %s\n", cuda_status_text().c_str(), gl.c_str());
  json["opengl"] = gl;
  std::vector<std::string> parts = missing_parts();
  for (const std::string& part :
       {live_missing(), genicam_missing(), ImageCoder::missing(), PhotoCoder::missing(), tiff_missing(),
        subtractors_missing(), web_missing(), web_page_missing(), window_missing(), headset_missing()}) {
    if (!part.empty()) parts.push_back(part);
  }
  for (const std::string& missing : parts) {
    std::printf("without  %s\n", missing.c_str());
    json["missing"].push_back(missing);
  }
  if (no_gl.empty()) {
    for (const DeviceInfo& d : list_devices()) {
      if (d.spec.kind != DeviceKind::cuda || !d.usable) continue;
      const std::unique_ptr<Device> device = open_device(d.spec);
      const std::string text = Renderer::sharing(*device);
      std::printf("         surfaces of %s: %s\n", device->name().c_str(), text.c_str());
      json["opengl_sharing"][device->name()] = text;
    }
  }
  if (!json_path.empty()) write_json_file(json_path, json);
}

/// The scene is set up on the CPU: its frame and parameters are the same everywhere.
void with_world(const std::string& scene_path, const std::function<void(World&)>& use) {
  const Scene scene = read_scene(scene_path);
  DeviceSet devices("cpu");
  const std::unique_ptr<FrameSource> source =
      open_frame_source(scene.source, {.colors = false, .depth = scene.reconstruction.depth});
  const BodyAssets assets = load_body_assets(scene);
  const auto perception = make_perception(devices, scene, source->rig(), assets);
  World world(devices, scene, assets, perception.get());
  use(world);
}

void print_frame(const World& world) { std::fputs(world.impl().schedule().text().c_str(), stdout); }

void print_parameters(World& world) {
  for (const SceneParameter& p : world.parameters().list())
    std::printf("%-44s %12s  %-26s %-12s  %s\n", p.name.c_str(), number_text(p.value).c_str(),
                p.range_text().c_str(), effect_text(p.effect), p.meaning.c_str());
}

}  // namespace

void add_info_command(CLI::App& app) {
  auto file_path = std::make_shared<std::string>();
  auto unit_m = std::make_shared<double>(1);
  auto json_path = std::make_shared<std::string>();
  auto frame_of = std::make_shared<std::string>();
  auto parameters_of = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "info",
      "What this machine offers: devices, memory, peers, versions; or what a mesh or label volume holds");
  CLI::Option* const file = command->add_option(
      "file", *file_path, "a mesh or label volume: bounds, volume, open edges, pieces, labels");
  command->add_option("--unit-m", *unit_m, "metres per unit of length in the mesh file (0.001: millimetres)")
      ->check(CLI::Range(1e-9, 1000.0));
  add_output(*command, "--json", *json_path, "the same as JSON (-: standard output)");
  CLI::Option* const frame = command->add_option(
      "--frame", *frame_of, "the frame of a scene: its stages in order, what they read and write");
  CLI::Option* const parameters =
      command->add_option("--parameters", *parameters_of,
                          "what of a scene may change while it runs (run --set): values and ranges");
  frame->excludes(file)->excludes(parameters)->excludes("--json");
  parameters->excludes(file)->excludes("--json");
  command->footer(
      "Examples:\n  tactus info --json info.json\n  tactus info --frame scenes/demo.yaml\n  tactus info "
      "--parameters scenes/touch.yaml\n  tactus info liver.nii.gz\n  tactus info scan.stl --unit-m 0.001");
  command->callback([json_path, frame_of, parameters_of, file_path, unit_m] {
    if (!file_path->empty()) {
      if (!json_path->empty()) output_is_writable(*json_path);
      const nlohmann::json json = print_file_info(*file_path, *unit_m);
      if (!json_path->empty()) write_json_file(*json_path, json);
      return;
    }
    if (!parameters_of->empty()) return with_world(*parameters_of, print_parameters);
    if (!frame_of->empty()) return with_world(*frame_of, print_frame);
    info(*json_path);
  });
}

}  // namespace tactus
