#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>

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

namespace tactus {
namespace {

struct ReconstructOptions {
  std::string source = "synthetic", what, devices = "auto", mesh_path, json_path, views_path, frames;
  int resolution = 100;
  std::optional<int> texture;
  bool moving = false;
  std::vector<double> workspace;
};

SourceDescription describe_source(const ReconstructOptions& options) {
  static const std::string kKinds[] = {"synthetic", "videos", "masks", "middlebury"};
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

/// Still pictures are frame 0. (Videos check their own range, sequences of masks end where the files end.)
void check_still(const ReconstructOptions& options, const SourceDescription& description,
                 const FrameSource& source) {
  const bool still = (description.kind == SourceKind::masks || description.kind == SourceKind::middlebury) &&
                     source.frame_count() == 1;
  if (still && description.frames.first > 0)
    throw usage_error("--frames '" + options.frames + "': '" + options.what + "' holds one frame, number 0");
}

/// "out.ply" and frame 7 of several -> "out-00007.ply".
std::string numbered(const std::string& path, std::int64_t tick, bool several) {
  if (!several) return path;
  char number[24];
  std::snprintf(number, sizeof number, "-%05lld", static_cast<long long>(tick));
  const std::size_t dot = path.rfind('.');
  return path.substr(0, dot) + number + (dot == std::string::npos ? "" : path.substr(dot));
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

/// All that turns frames into meshes, files and rows.
class Reconstruction {
 public:
  explicit Reconstruction(const ReconstructOptions& options)
      : options_(options),
        devices_(options.devices),
        description_(describe_source(options)),
        workspace_(workspace_of(options)),
        source_(open_frame_source(description_, true, workspace_, options.texture.has_value())),
        box_m_(workspace_ ? Box3f{vec_cast<float>(workspace_->min_m), vec_cast<float>(workspace_->max_m)}
                          : source_->rig().workspace_m),
        hull_(devices_, source_->rig().cameras, {.workspace_m = box_m_, .resolution = options.resolution}),
        normals_(devices_.device(0), hull_.mesh().positions_m.size()),
        motion_(hull_.voxel_size_m()),
        view_scores_(devices_.context(0), source_->rig().cameras, {.workspace_m = box_m_}),
        several_(description_.frames.last != description_.frames.first) {
    check_still(options, description_, *source_);
    if (options.texture) texture_.emplace(devices_, source_->rig(), hull_, box_m_, *options.texture);
  }

  nlohmann::json run() {
    nlohmann::json json{
        {"devices", devices_.name()}, {"commit", commit_text()}, {"frames", nlohmann::json::array()}};
    std::printf("%6s %9s %9s %6s %10s %8s %8s %8s %9s\n", "frame", "vertices", "triangles", "euler",
                "volume m3", "IoU", "IoU min", "recall", "total ms");
    FrameSet frame;
    while (!interrupted()) {
      const NextFrame next = source_->next(frame);
      if (next == NextFrame::no_more_data) break;
      if (!source_->status().empty()) log_warning(source_->status());
      if (next == NextFrame::bad_frame) continue;
      compute(frame);
      json["frames"].push_back(finish(frame));
    }
    if (json["frames"].empty() && !interrupted())
      throw Error("'" + options_.what + "' gave no usable frame: " + source_->status());
    return json;
  }

 private:
  void compute(const FrameSet& frame) {
    const auto stage = [&](const char* name, auto&& body) {
      const StageTimer timer(timings_, name);
      body();
      devices_.synchronize();
    };
    stage("total", [&] {
      stage("upload", [&] { hull_.upload(frame.silhouettes); });
      stage("hull", [&] { hull_.carve(); });
      stage("mesh", [&] { hull_.extract(); });
      stage("normals", [&] { normals_.compute(devices_.context(0), hull_.mesh(), hull_.voxel_size_m()); });
      if (texture_) stage("texture", [&] { texture_->shade(frame, hull_, normals_.view()); });
    });
  }

  /// Writes what is wanted of a frame; its row of measurements.
  nlohmann::json finish(const FrameSet& frame) {
    const HullReport report = hull_.report();
    if (!report.overflow.empty()) log_warning(report.overflow);
    TriangleMesh mesh = hull_.download();
    mesh.normals = to_host(devices_.context(0), normals_.view().part(0, report.vertices));
    if (!options_.mesh_path.empty()) {
      write_mesh(numbered(options_.mesh_path, frame.tick, several_), mesh,
                 texture_ ? texture_->colors(report.vertices) : std::vector<Rgb8>{});
    }
    if (!options_.views_path.empty())
      write_png(numbered(options_.views_path, frame.tick, several_),
                texture_->picture(hull_, normals_, mesh));
    nlohmann::json row = measure(mesh, source_->rig(), frame);
    {
      const StageTimer timer(timings_, "motion");
      motion_.add(mesh, frame, *source_, row);
    }
    std::vector<ViewScore> scores;
    {
      const StageTimer timer(timings_, "view_scores");
      scores = view_scores_.measure(devices_.context(0), frame.silhouettes);
    }
    std::string odd = add_view_scores(scores, source_->rig().cameras, row);
    if (!odd.empty()) log_warning(odd);
    if (odd.empty()) odd = source_->status();
    row["tick"] = frame.tick;
    row["status"] = report.overflow.empty() ? odd : report.overflow;
    for (const std::string& name : timings_.stages()) row["ms"][name] = timings_.last_ms(name);
    std::printf("%6lld %9zu %9zu %6lld %10.5f %8.4f %8.4f %8.4f %9.3f\n", static_cast<long long>(frame.tick),
                mesh.positions_m.size(), mesh.triangles.size(), row["euler"].get<long long>(),
                row["volume_m3"].get<double>(), row["iou_mean"].get<double>(), row["iou_min"].get<double>(),
                row["recall"].get<double>(), timings_.last_ms("total"));
    return row;
  }

  const ReconstructOptions& options_;
  DeviceSet devices_;
  SourceDescription description_;
  std::optional<BoxRegion> workspace_;
  std::unique_ptr<FrameSource> source_;
  Box3f box_m_;
  VisualHull hull_;
  SurfaceNormals normals_;
  MotionOutput motion_;
  ViewScores view_scores_;
  std::optional<TextureOutput> texture_;
  bool several_;
  Timings timings_;
};

void reconstruct(const ReconstructOptions& options) {
  check_outputs(options);
  const nlohmann::json json = Reconstruction(options).run();
  if (!options.json_path.empty()) write_json_file(options.json_path, json);
}

}  // namespace

void add_reconstruct_command(CLI::App& app) {
  auto options = std::make_shared<ReconstructOptions>();
  CLI::App* command = app.add_subcommand(
      "reconstruct", "Visual hull of a data set or a built-in figure, measured and written as a mesh");
  command->add_option("--source", options->source, "middlebury, videos, masks or synthetic")
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
  command->add_option("--texture", options->texture,
                      "colour the mesh (.ply) from the photos: each vertex from its best K cameras");
  command->add_option("--texture-views", options->views_path,
                      "with --texture: write a picture (.png) of three free views, K = 1 above K");
  command->add_flag("--moving", options->moving, "synthetic figures move");
  command->footer(
      "Examples:\n  tactus reconstruct --source synthetic hand --resolution 128 --mesh hand.ply\n"
      "  tactus reconstruct --source middlebury $TACTUS_DATA/middlebury_dino --resolution 256 --json "
      "dino.json\n"
      "  tactus reconstruct --source middlebury $TACTUS_DATA/middlebury_dino --texture 3 --mesh dino.ply\n"
      "  tactus reconstruct --source masks rigs/horseman-masks.yaml --resolution 200 --mesh horseman.ply");
  command->callback([options] { reconstruct(*options); });
}

}  // namespace tactus
