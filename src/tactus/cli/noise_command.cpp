#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/version.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/geom/image/mask_metrics.h"
#include "tactus/geom/image/rasterize.h"
#include "tactus/io/json_file.h"
#include "tactus/reconstruct/surface_pipeline.h"
#include "tactus/rig/synthetic/figure_tracer.h"
#include "tactus/rig/synthetic/synthetic_noise.h"
#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus {
namespace {

struct NoiseCommandOptions {
  std::string figure = "hand", devices = "cpu", json_path;
  int resolution = 100, runs = 5, slack_px = 0;
  SyntheticRigOptions rig;
};

/// Deviations of one reconstruction from the figure.
struct Quality {
  double volume_error = 0;  ///< of the truth
  double surface_rms_m = 0;
  double iou = 0;  ///< of its and the figure's masks in exact cameras, mean over cameras
};

/// A figure in motion, filmed with noise; the same moments for every noise.
class NoisyRig {
 public:
  explicit NoisyRig(const NoiseCommandOptions& options)
      : options_(options),
        devices_(options.devices),
        rig_(make_synthetic_rig(options.rig)),
        figure_(make_figure(options.figure, {.moving = true})) {}

  /// Quality with the silhouettes alone, and with depth where the rig has it.
  std::pair<Quality, std::optional<Quality>> measure(const NoiseOptions& noise, int run) const {
    const double time_s = 0.37 * run;
    std::vector<Camera> cameras, depth_cameras;
    std::vector<BitMask> masks;
    std::vector<DepthImage> depths_m;
    const int count = static_cast<int>(rig_.cameras.size());
    for (int c = 0; c < count; ++c) {
      const Camera& camera = rig_.cameras[static_cast<std::size_t>(c)];
      cameras.push_back(miscalibrate(camera, noise, c));
      masks.push_back(BitMask(camera.width_px, camera.height_px));
      trace(camera, time_s + sync_error_s(noise, c, run), &masks.back(), nullptr);
      disturb_mask(masks.back(), noise, c, run);
    }
    for (int d = 0; d < static_cast<int>(rig_.depth_cameras.size()); ++d) {
      const Camera& camera = rig_.depth_cameras[static_cast<std::size_t>(d)];
      depth_cameras.push_back(miscalibrate(camera, noise, count + d));
      depths_m.push_back(DepthImage(camera.width_px, camera.height_px));
      trace(camera, time_s + sync_error_s(noise, count + d, run), nullptr, &depths_m.back());
      disturb_depth(depths_m.back(), noise, count + d, run);
    }
    SurfacePipeline surface(devices_, cameras, depth_cameras,
                            {.hull = {.workspace_m = rig_.workspace_m,
                                      .resolution = options_.resolution,
                                      .slack_px = options_.slack_px}});
    std::optional<Quality> with_depth;
    if (!depths_m.empty()) with_depth = quality(surface, masks, depths_m, time_s);
    return {quality(surface, masks, {}, time_s), with_depth};
  }

 private:
  void trace(const Camera& camera, double time_s, BitMask* mask, DepthImage* distance_m) const {
    const FigureTracer tracer(camera);
    const FigureShape shape = figure_.at(time_s);
    for (Index strip = 0; strip < tracer.strip_count(); ++strip)
      tracer.trace_strip(shape, strip, mask, distance_m);
  }

  Quality quality(SurfacePipeline& surface, std::span<const BitMask> masks,
                  std::span<const DepthImage> depths_m, double time_s) const {
    surface.make(masks, depths_m);
    const HullReport report = surface.hull().report();
    if (report.overflow) throw Error("noise: " + report.overflow->text());
    const TriangleMesh mesh = surface.download();
    const FigureShape shape = figure_.at(time_s);
    Quality q;
    q.volume_error = volume_m3(mesh) / figure_volume(shape).volume_m3 - 1;
    for (const Vec3f p : mesh.positions_m) q.surface_rms_m += sqr(static_cast<double>(shape.distance_m(p)));
    q.surface_rms_m =
        std::sqrt(q.surface_rms_m / static_cast<double>(std::max<std::size_t>(mesh.positions_m.size(), 1)));
    for (const Camera& camera : rig_.cameras) {
      BitMask exact(camera.width_px, camera.height_px);
      trace(camera, time_s, &exact, nullptr);
      q.iou += iou(render_silhouette(mesh, camera), exact) / static_cast<double>(rig_.cameras.size());
    }
    return q;
  }

  const NoiseCommandOptions& options_;
  mutable DeviceSet devices_;
  Rig rig_;
  Figure figure_;
};

/// Mean over runs, and the standard deviation of the volume error.
struct Summary {
  Quality mean;
  double volume_deviation = 0;
  explicit Summary(const std::vector<Quality>& runs) {
    const auto n = static_cast<double>(runs.size());
    double squares = 0;
    for (const Quality& q : runs) {
      mean.volume_error += q.volume_error / n;
      mean.surface_rms_m += q.surface_rms_m / n;
      mean.iou += q.iou / n;
      squares += sqr(q.volume_error) / n;
    }
    volume_deviation = std::sqrt(std::max(squares - sqr(mean.volume_error), 0.0));
  }
  nlohmann::json json() const {
    return {{"volume_error", mean.volume_error},
            {"volume_deviation", volume_deviation},
            {"surface_rms_m", mean.surface_rms_m},
            {"iou", mean.iou}};
  }
  void print() const {
    std::printf("  %+7.2f +-%5.2f %8.2f %8.4f", 100 * mean.volume_error, 100 * volume_deviation,
                1e3 * mean.surface_rms_m, mean.iou);
  }
};

struct Step {
  const char* name;
  NoiseOptions noise;
};
std::vector<Step> steps() {
  std::vector<Step> list{{"none", {}}};
  for (const double px : {0.1, 0.3, 1.0, 3.0}) list.push_back({"calibration", {.calibration_px = px}});
  for (const double px : {0.3, 1.0, 2.0, 4.0}) list.push_back({"segmentation", {.segmentation_px = px}});
  for (const double ms : {2.0, 5.0, 15.0}) list.push_back({"sync", {.sync_ms = ms}});
  for (const double m : {0.002, 0.005, 0.02}) list.push_back({"depth", {.depth_m = m}});
  for (const double m : {0.003, 0.01}) list.push_back({"wiggle", {.wiggle_m = m}});
  list.push_back({"goal", {.calibration_px = 0.3, .segmentation_px = 1}});
  list.push_back(
      {"all",
       {.calibration_px = 0.3, .sync_ms = 2, .segmentation_px = 1, .depth_m = 0.005, .wiggle_m = 0.003}});
  return list;
}

std::string amount_text(const NoiseOptions& noise) {
  std::string text;
  const auto add = [&text](double value, const char* unit) {
    if (value == 0) return;
    char part[32];
    std::snprintf(part, sizeof part, "%s%g %s", text.empty() ? "" : ", ", value, unit);
    text += part;
  };
  add(noise.calibration_px, "px");
  add(noise.segmentation_px, "px");
  add(noise.sync_ms, "ms");
  add(1e3 * noise.depth_m, "mm");
  add(1e3 * noise.wiggle_m, "mm");
  return text;
}

void check(const NoiseCommandOptions& options) {
  if (options.runs < 1 || options.runs > 1000)
    throw usage_error("--runs " + std::to_string(options.runs) + ": expected 1 to 1000");
  if (!options.json_path.empty()) output_is_writable(options.json_path);
}

void run_noise(const NoiseCommandOptions& options) {
  check(options);
  const NoisyRig rig(options);
  nlohmann::json json{{"commit", commit_text()},
                      {"figure", options.figure},
                      {"resolution", options.resolution},
                      {"runs", options.runs},
                      {"rows", nlohmann::json::array()}};
  std::printf("%-12s %-26s  %-34s  %s\n%-12s %-26s  %15s %8s %8s  %15s %8s %8s\n", "", "",
              "silhouettes alone", options.rig.depth_cameras > 0 ? "with depth" : "", "noise", "", "volume %",
              "RMS mm", "IoU", "volume %", "RMS mm", "IoU");
  for (const Step& step : steps()) {
    std::vector<Quality> plain, deep;
    for (int run = 0; run < options.runs && !interrupted(); ++run) {
      NoiseOptions noise = step.noise;
      noise.seed = static_cast<std::uint64_t>(run) + 1;
      const auto [silhouettes, depth] = rig.measure(noise, run);
      plain.push_back(silhouettes);
      if (depth) deep.push_back(*depth);
    }
    if (interrupted()) break;
    const std::string amount = amount_text(step.noise);
    nlohmann::json row{{"noise", step.name}, {"amount", amount}, {"silhouettes", Summary(plain).json()}};
    std::printf("%-12s %-26s", step.name, amount.c_str());
    Summary(plain).print();
    if (!deep.empty()) {
      row["depth"] = Summary(deep).json();
      Summary(deep).print();
    }
    std::printf("\n");
    std::fflush(stdout);
    json["rows"].push_back(std::move(row));
  }
  if (interrupted()) json["interrupted"] = true;
  if (!options.json_path.empty()) write_json_file(options.json_path, json);
}

}  // namespace

void add_noise_command(CLI::App& app) {
  auto options = std::make_shared<NoiseCommandOptions>();
  CLI::App* command = app.add_subcommand(
      "noise", "What noise of cameras, masks and depth does to the hull of a figure: a table");
  command->add_option("figure", options->figure, "built-in figure; it moves")->capture_default_str();
  command->add_option("--runs", options->runs, "moments and noises to average over")->capture_default_str();
  command->add_option("--resolution", options->resolution, "voxels along the longest side of the workspace")
      ->capture_default_str();
  command->add_option("--cameras", options->rig.camera_count, "in a ring around the workspace")
      ->capture_default_str();
  command->add_option("--depth-cameras", options->rig.depth_cameras, "time-of-flight, 0 to 32")
      ->capture_default_str();
  command->add_option("--slack-px", options->slack_px, "grow silhouettes by so many pixels before they carve")
      ->capture_default_str();
  add_devices(*command, options->devices);
  add_output(*command, "--json", options->json_path, "write the rows (-: standard output)");
  command->footer("Example:\n  tactus noise hand --runs 20 --json noise.json");
  command->callback([options] { run_noise(*options); });
}

}  // namespace tactus
