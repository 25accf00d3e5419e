#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <span>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/frame_sources.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/motion_output.h"
#include "tactus/cli/texture_output.h"
#include "tactus/cli/version.h"
#include "tactus/geom/mask_metrics.h"
#include "tactus/geom/rasterize.h"
#include "tactus/io/json_file.h"
#include "tactus/io/mesh_file.h"
#include "tactus/io/safe_file.h"
#include "tactus/reconstruct/view_scores.h"
#include "tactus/reconstruct/visual_hull.h"
#include "tactus/rig/synthetic_source.h"

namespace tactus {
namespace {

struct ReconstructOptions {
  std::string source = "synthetic", what, devices = "auto", mesh_path, json_path, views_path, frames;
  int resolution = 100;
  std::optional<int> slack_px;
  std::optional<int> texture;
  bool moving = false, no_depth = false;
  std::vector<double> workspace;
};

SourceDescription describe_source(const ReconstructOptions& options) {
  static const std::string kKinds[] = {"synthetic", "videos", "masks", "middlebury", "kinect"};
  SourceDescription source;
  const auto* kind = std::find(std::begin(kKinds), std::end(kKinds), options.source);
  if (kind == std::end(kKinds))
    throw usage_error("--source '" + options.source + "' is unknown" + suggestion(options.source, kKinds));
  source.kind = static_cast<SourceKind>(kind - std::begin(kKinds));
  (source.kind == SourceKind::synthetic ? source.figure : source.path) = options.what;
  source.moving = options.moving;
  source.frames = {0, source.kind == SourceKind::videos ? std::nullopt : std::optional<int>(0)};
  if (!options.frames.empty()) {
    const std::optional<FrameRange> range = parse_frame_range(options.frames);
    if (!range)
      throw usage_error("--frames '" + options.frames + "': expected A-B, A- or A with 0 <= A <= B");
    source.frames = *range;
  }
  return source;
}

std::optional<BoxRegion> workspace_of(const ReconstructOptions& options) {
  const std::vector<double>& w = options.workspace;
  if (w.empty()) return {};
  if (w.size() != 6)
    throw usage_error("--workspace takes six numbers (x0,y0,z0,x1,y1,z1), not " + std::to_string(w.size()));
  return BoxRegion{{w[0], w[1], w[2]}, {w[3], w[4], w[5]}};
}

/// What would spoil the outputs, found before the work.
void check_outputs(const ReconstructOptions& options) {
  if (!options.json_path.empty()) output_is_writable(options.json_path);
  if (!options.views_path.empty()) {
    if (!options.texture) throw usage_error("--texture-views needs --texture K");
    check_writable(options.views_path);
  }
  if (options.mesh_path.empty()) return;
  const std::string& path = options.mesh_path;
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  if (extension != ".ply" && extension != ".obj")
    throw usage_error("--mesh '" + path + "': expected a name that ends in .ply or .obj");
  if (options.texture && extension == ".obj")
    throw usage_error("--mesh '" + path + "': OBJ holds no colours; with --texture, write .ply");
  output_is_writable(path);
}

/// "out.ply" and frame 7 of several -> "out-00007.ply".
std::string numbered(const std::string& path, std::int64_t tick, bool several) {
  if (!several) return path;
  char number[24];
  std::snprintf(number, sizeof number, "-%05lld", static_cast<long long>(tick));
  const std::size_t dot = path.rfind('.');
  return path.substr(0, dot) + number + (dot == std::string::npos ? "" : path.substr(dot));
}

/// Root mean square distance of the vertices from the figure's true surface [m].
double surface_rms_m(const TriangleMesh& mesh, const FigureShape& truth) {
  double sum = 0;
  for (const Vec3f p : mesh.positions_m) sum += sqr(static_cast<double>(truth.distance_m(p)));
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(mesh.positions_m.size(), 1)));
}

nlohmann::json measure(const TriangleMesh& mesh, const Rig& rig, const FrameSet& frame) {
  const MeshTopology t = topology(mesh);
  double iou_sum = 0, iou_min = 1, recall_sum = 0;
  int used = 0;
  nlohmann::json views = nlohmann::json::array();
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    if (frame.silhouettes[c].words.empty()) continue;
    const BitMask seen = render_silhouette(mesh, rig.cameras[c]);
    const double overlap = iou(seen, frame.silhouettes[c]);
    iou_sum += overlap;
    iou_min = std::min(iou_min, overlap);
    const double covered = recall(seen, frame.silhouettes[c]);
    recall_sum += covered;
    views.push_back({{"camera", rig.cameras[c].name}, {"iou", overlap}, {"recall", covered}});
    ++used;
  }
  nlohmann::json json{{"vertices", mesh.positions_m.size()},
                      {"triangles", mesh.triangles.size()},
                      {"boundary_edges", t.boundary_edges},
                      {"nonmanifold_edges", t.nonmanifold_edges},
                      {"euler", t.euler},
                      {"components", t.components},
                      {"volume_m3", volume_m3(mesh)},
                      {"iou_mean", used > 0 ? iou_sum / used : 0},
                      {"iou_min", iou_min},
                      {"recall", used > 0 ? recall_sum / used : 0}};
  json["views"] = std::move(views);
  if (frame.truth_volume_m3) json["truth_volume_m3"] = *frame.truth_volume_m3;
  return json;
}

/// Returns what is odd about them.
std::string add_view_scores(const std::vector<ViewScore>& scores, const std::vector<Camera>& cameras,
                            nlohmann::json& row) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t c = 0; c < scores.size(); ++c) {
    list.push_back({{"camera", cameras[c].name},
                    {"carved_alone", scores[c].carved_alone},
                    {"suspect", scores[c].is_suspect}});
  }
  row["view_scores"] = std::move(list);
  return suspect_views_text(cameras, scores);
}

/// One line of what is not empty.
std::string joined(std::initializer_list<std::string_view> parts) {
  std::string line;
  for (const std::string_view part : parts) {
    if (!part.empty()) line.append(line.empty() ? "" : "; ").append(part);
  }
  return line;
}

void reconstruct(const ReconstructOptions& options) {
  check_outputs(options);
  DeviceSet devices(options.devices);
  const SourceDescription description = describe_source(options);
  const std::optional<BoxRegion> workspace = workspace_of(options);
  const std::unique_ptr<FrameSource> source =
      open_frame_source(description, {.truth = true,
                                      .colors = options.texture.has_value(),
                                      .depth = !options.no_depth,
                                      .workspace_m = workspace});
  Box3f box = source->rig().workspace_m;
  if (workspace) box = {vec_cast<float>(workspace->min_m), vec_cast<float>(workspace->max_m)};
  const std::optional<Camera>& tof = source->rig().depth_camera;
  const bool use_depth = tof.has_value() && !options.no_depth;
  HullOptions hull_options{.workspace_m = box,
                           .resolution = options.resolution,
                           .slack_px = options.slack_px.value_or(source->rig().slack_px)};
  // A whole room's depth is rough: noise, and walls along the rays wherever it ends.
  if (description.kind == SourceKind::kinect)
    hull_options.max_vertices =
        static_cast<Index>(std::min(15.0 * sqr<double>(options.resolution) + 20000, 2e8));
  VisualHull hull(devices, source->rig().cameras, hull_options,
                  std::span(use_depth ? &*tof : nullptr, use_depth ? 1 : 0));
  const auto* synthetic = dynamic_cast<const SyntheticSource*>(source.get());

  SurfaceNormals normals(devices.device(0), hull.mesh().positions_m.size());
  std::optional<TextureOutput> texture;
  if (options.texture) texture.emplace(devices, source->rig(), hull, box, *options.texture);

  MotionOutput motion(hull.voxel_size_m());
  ViewScores view_scores(devices.context(0), source->rig().cameras, {.workspace_m = box});

  const bool several = description.frames.last != description.frames.first;
  nlohmann::json json{{"devices", devices.name()},
                      {"commit", commit_text()},
                      {"depth", use_depth},
                      {"frames", nlohmann::json::array()},
                      {"bad_frames", nlohmann::json::array()}};
  std::printf("%6s %9s %9s %6s %10s %8s %8s %8s %9s\n", "frame", "vertices", "triangles", "euler",
              "volume m3", "IoU", "IoU min", "recall", "total ms");
  FrameSet frame;
  Timings timings;
  while (!interrupted()) {
    const NextFrame next = source->next(frame);
    if (next == NextFrame::no_more_data) break;
    if (!source->status().empty()) log_warning(source->status());
    if (next == NextFrame::bad_frame) {
      json["bad_frames"].push_back({{"tick", frame.tick}, {"status", source->status()}});
      continue;
    }
    const auto stage = [&](const char* name, auto&& body) {
      const StageTimer timer(timings, name);
      body();
      devices.synchronize();
    };
    stage("total", [&] {
      stage("upload", [&] { hull.upload(frame.silhouettes, std::span(&frame.depth_m, use_depth ? 1 : 0)); });
      stage("hull", [&] { hull.carve(); });
      stage("mesh", [&] { hull.extract(); });
      stage("normals", [&] { normals.compute(devices.context(0), hull.mesh(), hull.voxel_size_m()); });
      if (texture) stage("texture", [&] { texture->shade(frame, hull, normals.view()); });
    });
    const HullReport report = hull.report();
    if (!report.overflow.empty()) log_warning(report.overflow);
    if (!report.depth.empty()) log_warning(report.depth);
    TriangleMesh mesh = hull.download();
    mesh.normals = to_host(devices.context(0), normals.view().part(0, report.vertices));
    if (!options.mesh_path.empty()) {
      write_mesh(numbered(options.mesh_path, frame.tick, several), mesh,
                 texture ? texture->colors(report.vertices) : std::vector<Rgb8>{});
    }
    if (!options.views_path.empty())
      write_png(numbered(options.views_path, frame.tick, several), texture->picture(hull, normals, mesh));
    nlohmann::json row = measure(mesh, source->rig(), frame);
    motion.add(mesh, frame, *source, row);
    const std::string odd = add_view_scores(view_scores.measure(devices.context(0), frame.silhouettes),
                                            source->rig().cameras, row);
    if (!odd.empty()) log_warning(odd);
    row["tick"] = frame.tick;
    if (synthetic != nullptr)
      row["surface_rms_m"] = surface_rms_m(mesh, synthetic->figure().at(frame.time_s));
    row["status"] = joined({report.overflow, report.depth, source->status(), odd});
    for (const std::string& name : timings.stages()) row["ms"][name] = timings.last_ms(name);
    std::printf("%6lld %9zu %9zu %6lld %10.5f %8.4f %8.4f %8.4f %9.3f\n", static_cast<long long>(frame.tick),
                mesh.positions_m.size(), mesh.triangles.size(), row["euler"].get<long long>(),
                row["volume_m3"].get<double>(), row["iou_mean"].get<double>(), row["iou_min"].get<double>(),
                row["recall"].get<double>(), timings.last_ms("total"));
    json["frames"].push_back(std::move(row));
  }
  if (json["frames"].empty() && !interrupted())
    throw Error("'" + options.what + "' gave no usable frame: " + source->status());
  if (!options.json_path.empty()) write_json_file(options.json_path, json);
}

}  // namespace

void add_reconstruct_command(CLI::App& app) {
  auto options = std::make_shared<ReconstructOptions>();
  CLI::App* command = app.add_subcommand(
      "reconstruct", "Visual hull of a data set or a built-in figure, measured and written as a mesh");
  command->add_option("--source", options->source, "middlebury, videos, masks, kinect or synthetic")
      ->capture_default_str();
  command->add_option("what", options->what, "folder, rig file, or figure")->required();
  command->add_option("--resolution", options->resolution, "voxels along the longest side of the workspace")
      ->capture_default_str();
  command->add_option("--frames", options->frames, "A-B, A- or A (default: the first; videos: all)");
  command->add_option("--devices", options->devices, "cpu, cpu:N (virtual), cuda:0, cuda:0-3, cuda:all, auto")
      ->capture_default_str();
  command->add_option("--mesh", options->mesh_path,
                      "write the mesh (.ply, .obj); several frames get a number");
  command->add_option("--json", options->json_path, "write the measurements");
  command->add_option("--workspace", options->workspace, "x0,y0,z0,x1,y1,z1 [m] instead of the rig's")
      ->delimiter(',');
  command->add_option("--slack-px", options->slack_px,
                      "grow silhouettes by so many pixels before they carve");
  command->add_option("--texture", options->texture,
                      "colour the mesh (.ply) from the photos: each vertex from its best K cameras");
  command->add_option("--texture-views", options->views_path,
                      "with --texture: write a picture (.png) of three free views, K = 1 above K");
  command->add_flag("--no-depth", options->no_depth, "silhouettes alone, though the source has depth");
  command->add_flag("--moving", options->moving, "synthetic figures move");
  command->footer(
      "Examples:\n  tactus reconstruct --source synthetic hand --resolution 128 --mesh hand.ply\n"
      "  tactus reconstruct --source middlebury $TACTUS_DATA/middlebury_dino --resolution 256 --json "
      "dino.json\n"
      "  tactus reconstruct --source middlebury $TACTUS_DATA/middlebury_dino --texture 3 --mesh dino.ply\n"
      "  tactus reconstruct --source masks rigs/horseman-masks.yaml --resolution 200 --mesh horseman.ply\n"

      "  tactus reconstruct --source kinect $TACTUS_DATA/azure_kinect_tof --resolution 200 --mesh room.ply");
  command->callback([options] { reconstruct(*options); });
}

}  // namespace tactus
