#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <span>

#include "tactus/base/camera_lines.h"
#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/interrupt.h"
#include "tactus/cli/output/motion_output.h"
#include "tactus/cli/output/texture_output.h"
#include "tactus/cli/output/view_check.h"
#include "tactus/cli/program.h"
#include "tactus/cli/reconstruct_measures.h"
#include "tactus/cli/source_flags.h"
#include "tactus/cli/version.h"
#include "tactus/frame/schedule.h"
#include "tactus/geom/figures/figures.h"
#include "tactus/io/json_file.h"
#include "tactus/io/mesh/mesh_file.h"
#include "tactus/reconstruct/doctor/workspace_from_cones.h"
#include "tactus/reconstruct/surface_pipeline.h"
#include "tactus/run/frame_sources.h"

namespace tactus {
namespace {

struct ReconstructOptions {
  std::string source = "synthetic", what, devices = "auto", mesh_path, json_path, views_path, frames;
  int resolution = 100;
  std::optional<int> slack_px;
  std::optional<int> texture;
  int smooth = 0, tolerated_views = 0, min_views = 2, depth_cameras = 1;
  int max_vertices = 0, max_triangles = 0, max_active_bricks = 0;
  double depth_jump_m = 0.1;
  bool moving = false, no_depth = false, repair_masks = false;
  std::vector<std::string> workspace;
  ThresholdOptions threshold;
};

SourceDescription describe_source(const ReconstructOptions& options) {
  SourceDescription source = tactus::describe_source(options.source, options.what, options.frames);
  source.moving = options.moving;
  source.depth_cameras = options.depth_cameras;
  return source;
}

bool takes_workspace_from_cones(const ReconstructOptions& options) {
  return options.workspace.size() == 1 && options.workspace[0] == "auto";
}

std::optional<BoxRegion> workspace_of(const ReconstructOptions& options) {
  if (options.workspace.empty() || takes_workspace_from_cones(options)) return {};
  if (options.workspace.size() != 6)
    throw usage_error("--workspace takes six numbers (x0,y0,z0,x1,y1,z1) or auto, not " +
                      std::to_string(options.workspace.size()));
  std::vector<double> w;
  for (const std::string& text : options.workspace) {
    char* end = nullptr;
    w.push_back(std::strtod(text.c_str(), &end));
    if (text.empty() || *end != '\0' || !std::isfinite(w.back()))
      throw usage_error("--workspace: '" + text + "', expected a number of metres, or auto alone");
  }
  return BoxRegion{{w[0], w[1], w[2]}, {w[3], w[4], w[5]}};
}

void check_capacities(const ReconstructOptions& options) {
  if (options.smooth < 0 || options.smooth > 100)
    throw usage_error("--smooth " + std::to_string(options.smooth) + ": expected 0 (as it is) to 100 steps");
  if (!(options.depth_jump_m > 0 && options.depth_jump_m <= 100))
    throw usage_error("--depth-jump-m " + number_text(options.depth_jump_m) + ": expected > 0 to 100 m");
  for (const auto& [flag, value] : {std::pair{"--max-vertices", options.max_vertices},
                                    {"--max-triangles", options.max_triangles},
                                    {"--max-active-bricks", options.max_active_bricks}}) {
    if (value < 0 || value > 1 << 30)
      throw usage_error(std::string(flag) + " " + std::to_string(value) +
                        ": expected 1 to 2^30, or 0 (from the resolution)");
  }
}

/// In small letters, with its dot; standard output gets PLY.
std::string extension_of(const std::string& path) {
  if (path == "-") return ".ply";
  std::string extension = std::filesystem::path(path).extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}
bool is_gltf(const std::string& path) {
  return extension_of(path) == ".glb" || extension_of(path) == ".gltf";
}

/// Refuses options that would spoil the outputs, before the work.
void check_outputs(const ReconstructOptions& options) {
  if (!options.json_path.empty()) output_is_writable(options.json_path);
  if (!options.views_path.empty()) {
    if (!options.texture) throw usage_error("--texture-views needs --texture K");
    output_is_writable(options.views_path);
  }
  const FrameRange frames = describe_source(options).frames;
  if (frames.last != frames.first && (options.mesh_path == "-" || options.views_path == "-"))
    throw usage_error("'-' (standard output) holds one frame; with --frames " + frame_range_text(frames) +
                      ", give a file name");
  if (options.mesh_path.empty()) return;
  const std::string& path = options.mesh_path;
  const std::string extension = extension_of(path);
  if (extension != ".ply" && extension != ".obj" && !is_gltf(path))
    throw usage_error("--mesh '" + path + "': expected a name that ends in .ply, .obj, .glb or .gltf");
  if (options.texture && extension == ".obj")
    throw usage_error("--mesh '" + path +
                      "': OBJ holds no colours; with --texture, write .ply, .glb or .gltf");
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

/// One line of the parts that are not empty, with "; " between them.
std::string joined(std::initializer_list<std::string_view> parts) {
  std::string line;
  for (const std::string_view part : parts) {
    if (!part.empty()) line.append(line.empty() ? "" : "; ").append(part);
  }
  return line;
}

std::unique_ptr<FrameSource> open_described(const ReconstructOptions& options) {
  const std::span<const std::string> figures = figure_names();
  const bool is_figure = std::find(figures.begin(), figures.end(), options.what) != figures.end();
  if (describe_source(options).kind == SourceKind::synthetic && !is_figure &&
      std::filesystem::exists(options.what))
    throw usage_error(
        "'" + options.what +
        "' is a file or folder, and the source 'synthetic' makes figures: say what reads it, as "
        "--source masks or --source videos");
  return open_frame_source(describe_source(options), {.truth = true,
                                                      .colors = options.texture.has_value(),
                                                      .depth = !options.no_depth,
                                                      .workspace_m = workspace_of(options),
                                                      .threshold = options.threshold});
}

Box3f workspace_m(const ReconstructOptions& options, const Rig& rig) {
  const std::optional<BoxRegion> asked = workspace_of(options);
  return asked ? Box3f{vec_cast<float>(asked->min_m), vec_cast<float>(asked->max_m)} : rig.workspace_m;
}

HullOptions hull_options(const ReconstructOptions& options, const Rig& rig) {
  HullOptions hull{.workspace_m = workspace_m(options, rig),
                   .resolution = options.resolution,
                   .slack_px = options.slack_px.value_or(rig.slack_px),
                   .tolerated_views = options.tolerated_views,
                   .min_views = options.min_views,
                   .max_active_bricks = options.max_active_bricks,
                   .max_vertices = options.max_vertices,
                   .max_triangles = options.max_triangles,
                   .depth_jump_m = static_cast<float>(options.depth_jump_m)};
  // A whole capacity's depth is rough: noise, and walls along the rays wherever it ends.
  if (options.max_vertices == 0 && describe_source(options).kind == SourceKind::kinect)
    hull.max_vertices = static_cast<Index>(std::min(15.0 * sqr<double>(options.resolution) + 20000, 2e8));
  return hull;
}

/// The capacity that is too small, and the flag that raises it.
std::string overflow_text(const HullOverflow& overflow) {
  std::string flag = "--" + overflow.option;
  std::replace(flag.begin(), flag.end(), '_', '-');
  return overflow.text(flag);
}

/// The limit of that overflow.
template <class Options>
auto& capacity_of(const HullOverflow& overflow, Options& options) {
  if (overflow.option == "max_active_bricks") return options.max_active_bricks;
  return overflow.option == "max_vertices" ? options.max_vertices : options.max_triangles;
}

/// The stages that make meshes, with the capacities of the options.
struct SurfaceStages {
  SurfaceStages(DeviceSet& devices, const Rig& rig, const ReconstructOptions& options,
                const HullOptions& hull_options)
      : pipeline(devices, rig.cameras, rig.depth_cameras,
                 {.hull = hull_options, .smoothing_steps = options.smooth}),
        schedule(devices) {
    if (options.texture)
      texture.emplace(devices, rig, pipeline.hull(), workspace_m(options, rig), *options.texture);
    for (Stage& stage :
         pipeline.stages([this] { pipeline.hull().upload(frame->silhouettes, frame->depths_m); }))
      schedule.add(std::move(stage));
    schedule.add({.name = "surface/normals",
                  .timed_as = "normals",
                  .rate = Rate::capture,
                  .reads = {VisualHull::kMesh},
                  .submit = [this](BlockPlace) { pipeline.compute_normals(); }});
    schedule.close();
  }
  SurfacePipeline pipeline;
  Schedule schedule;
  std::optional<TextureOutput> texture;
  const FrameSet* frame = nullptr;  ///< while it is uploaded
};

/// From frames to meshes, files and rows of measurements.
class Reconstruction {
 public:
  Reconstruction(DeviceSet& devices, FrameSource& source, const ReconstructOptions& options)
      : devices_(devices),
        source_(source),
        options_(options),
        hull_options_(hull_options(options, source.rig())),
        stages_(std::make_unique<SurfaceStages>(devices, source.rig(), options, hull_options_)),
        motion_(devices.context(0), stages_->pipeline.voxel_size_m()),
        views_(devices.context(0), source.rig(), workspace_m(options, source.rig()),
               stages_->pipeline.voxel_size_m(), options.repair_masks) {}

  /// @param several whether files get the number of their frame
  /// @throws Error, before anything is written, when nothing can be right or when the capacity that the
  /// options set is too little for a closed mesh.
  nlohmann::json add(FrameSet& frame, bool several) {
    views_.check(devices_.context(0), frame);
    const HullReport report = make_surface(frame);
    const std::string found = views_.judge(devices_.context(0), frame, stages_->pipeline.hull().mesh());
    has_surface_ |= report.vertices > 0;
    if (!several) check_surface(joined({found, source_.status()}));
    const TriangleMesh mesh = write_files(frame, several);
    nlohmann::json row = measure(mesh, source_.rig(), frame, views_.given(frame));
    motion_.add(stages_->pipeline.surface(), mesh, frame, source_, row);
    views_.add_to(row);
    const std::string repaired = repaired_text(row), odd = joined({views_.status(), repaired, found});
    for (const std::string& warning : {report.depth, views_.status(), repaired, found})
      warn(warning, kind_of_line);
    row["tick"] = frame.tick;
    if (const Figure* truth = source_.truth())
      row["surface_rms_m"] = surface_rms_m(mesh, truth->at(frame.time_s));
    row["status"] = joined({report.depth, source_.status(), odd});
    for (const std::string& name : timings_.stages()) row["ms"][name] = timings_.last_ms(name);
    return row;
  }

  /// Each line once; rows of the results have them all. @param line_of a line, or the part that is the same
  /// in those of other frames
  template <class F>
  void warn(const std::string& status, F&& line_of) {
    std::string fresh;
    for (const std::string_view line : camera_lines(status)) {
      if (line.empty() || !said_.insert(std::string(camera_of_line(line)) + line_of(line)).second) continue;
      fresh.append(fresh.empty() ? "" : "; ").append(line);
    }
    if (!fresh.empty()) log_warning(fresh);
  }
  void warn(const std::string& status) {
    warn(status, [](std::string_view line) { return std::string(line); });
  }

  /// @throws Error when no frame so far has a surface: where all is outside, measures say nothing.
  /// @param why appended where it isn't empty
  void check_surface(const std::string& why) const {
    if (!has_surface_)
      throw Error("'" + options_.what + "': nothing is left of what the masks show" +
                  (why.empty() ? "" : ": " + why));
  }

 private:
  /// A surface that needs more capacity than there is gets it, and the frame is made again; each round shows
  /// at most one more of bricks, vertices and triangles to be too few.
  HullReport make_surface(const FrameSet& frame) {
    for (;;) {
      time_stages(frame);
      HullReport report = stages_->pipeline.hull().report();
      if (!report.overflow) return report;
      const std::string text = "frame " + std::to_string(frame.tick) + ": " + overflow_text(*report.overflow);
      if (capacity_of(*report.overflow, options_) > 0)
        throw Error(text + "; its mesh would be open and is not written");
      // Half as much again: the next frames may need some more. Lists of bricks and of vertices have an end.
      const double most = report.overflow->option == "max_active_bricks" ? 3e7 : 7e8;
      if (report.overflow->wanted >= most) throw Error(text + ", which is more than there can be");
      capacity_of(*report.overflow, hull_options_) =
          static_cast<Index>(std::min(1.5 * report.overflow->wanted, most));
      log_debug(text + "; capacity is made, and the frame done again");
      stages_.reset();  // its memory, before that of the next
      stages_ = std::make_unique<SurfaceStages>(devices_, source_.rig(), options_, hull_options_);
    }
  }

  void time_stages(const FrameSet& frame) {
    SurfaceStages& s = *stages_;
    const StageTimer total(timings_, "total");
    s.frame = &frame;
    s.schedule.run({}, true);
    s.schedule.finish(timings_);
    if (!s.texture) return;
    const StageTimer texture(timings_, "texture");
    s.texture->shade(frame, s.pipeline.surface(), s.pipeline.normals());
    devices_.synchronize();
  }

  TriangleMesh write_files(const FrameSet& frame, bool several) {
    SurfaceStages& s = *stages_;
    TriangleMesh mesh = s.pipeline.download();
    if (!options_.mesh_path.empty())
      write_surface(frame, mesh, numbered(options_.mesh_path, frame.tick, several));
    if (!options_.views_path.empty())
      write_png(numbered(options_.views_path, frame.tick, several),
                s.texture->picture(s.pipeline.surface(), s.pipeline.normals(), mesh));
    return mesh;
  }

  void write_surface(const FrameSet& frame, const TriangleMesh& mesh, const std::string& path) {
    SurfaceStages& s = *stages_;
    if (s.texture && is_gltf(path)) {
      const TexturedMesh textured =
          s.texture->textured(frame, s.pipeline.surface(), s.pipeline.normals(), mesh);
      write_gltf(path, textured, encode_png(textured.atlas));
      return;
    }
    write_mesh(
        path, mesh,
        s.texture ? s.texture->colors(static_cast<Index>(mesh.positions_m.size())) : std::vector<Rgb8>{});
  }

  DeviceSet& devices_;
  FrameSource& source_;
  const ReconstructOptions& options_;
  HullOptions hull_options_;
  std::unique_ptr<SurfaceStages> stages_;
  MotionOutput motion_;
  ViewCheck views_;
  Timings timings_;
  bool has_surface_ = false;
  std::set<std::string> said_;
};

void print_row(const nlohmann::json& row) {
  std::printf("%6lld %9lld %9lld %6lld %10.5f %8.4f %8.4f %8.4f %9.3f\n", row["tick"].get<long long>(),
              row["vertices"].get<long long>(), row["triangles"].get<long long>(),
              row["euler"].get<long long>(), row["volume_m3"].get<double>(), row["iou_mean"].get<double>(),
              row["iou_min"].get<double>(), row["recall"].get<double>(), row["ms"]["total"].get<double>());
  std::fflush(stdout);  // whoever reads through a pipe sees frames as they come
}

/// Six numbers in place of `auto`, from the first usable frame.
void find_workspace(ReconstructOptions& options) {
  const std::unique_ptr<FrameSource> source = open_described(options);
  FrameSet frame;
  NextFrame next = source->next(frame);
  while (next == NextFrame::bad_frame || next == NextFrame::nothing_new) next = source->next(frame);
  if (next == NextFrame::no_more_data)
    throw Error("'" + options.what + "' gave no usable frame: " + source->status());
  const std::optional<ConeBox> cones = workspace_from_cones(source->rig().cameras, frame.silhouettes);
  if (!cones)
    throw Error(
        "--workspace auto: the cones of the silhouettes do not meet; `tactus doctor RIG` looks for the "
        "cause");
  if (!cones->is_bounded)
    log_warning("--workspace auto: the masks touch the borders of their images, and the cones are open");
  options.workspace.clear();
  for (const Vec3f corner : {cones->box_m.min, cones->box_m.max}) {
    for (int i = 0; i < 3; ++i) options.workspace.push_back(number_text(static_cast<double>(corner[i])));
  }
}

void reconstruct(ReconstructOptions options) {
  check_capacities(options);
  check_threshold_flags(options.threshold);
  if (takes_workspace_from_cones(options)) find_workspace(options);
  check_outputs(options);
  DeviceSet devices(options.devices);
  const std::unique_ptr<FrameSource> source = open_described(options);
  const FrameRange frames = describe_source(options).frames;
  nlohmann::json json{{"devices", devices.name()},
                      {"commit", commit_text()},
                      {"depth", !source->rig().depth_cameras.empty()},
                      {"frames", nlohmann::json::array()},
                      {"bad_frames", nlohmann::json::array()}};
  FramePatience patience([&] {
    if (!options.json_path.empty()) write_json_file(options.json_path, json);
  });
  patience.begin();
  Reconstruction reconstruction(devices, *source, options);
  patience.end();
  if (const std::string cost = cost_text(options.resolution, workspace_m(options, source->rig()));
      !cost.empty())
    log_info(cost);
  std::printf("%6s %9s %9s %6s %10s %8s %8s %8s %9s\n", "frame", "vertices", "triangles", "euler",
              "volume m3", "IoU", "IoU min", "recall", "total ms");
  std::fflush(stdout);
  FrameSet frame;
  while (!interrupted()) {
    const NextFrame next = source->next(frame);
    if (next == NextFrame::no_more_data) break;
    if (next == NextFrame::nothing_new) continue;
    reconstruction.warn(source->status());
    if (next == NextFrame::bad_frame) {
      json["bad_frames"].push_back({{"tick", frame.tick}, {"status", source->status()}});
      continue;
    }
    patience.begin();
    nlohmann::json row = reconstruction.add(frame, frames.last != frames.first);
    patience.end();
    print_row(row);
    json["frames"].push_back(std::move(row));
  }
  if (json["frames"].empty() && !interrupted())
    throw Error("'" + options.what + "' gave no usable frame: " + source->status());
  if (!source->damage().empty()) json["damage"] = source->damage();
  note_damage(source->damage());
  if (!options.json_path.empty()) write_json_file(options.json_path, json);
  if (!json["frames"].empty()) reconstruction.check_surface(source->status());
}

}  // namespace

void add_reconstruct_command(CLI::App& app) {
  auto options = std::make_shared<ReconstructOptions>();
  CLI::App* command = app.add_subcommand(
      "reconstruct", "Visual hull of a data set or a built-in figure, measured and written as a mesh");
  command->add_option("--source", options->source, source_kind_words())->capture_default_str();
  command->add_option("what", options->what, "folder, rig file, or figure")->required();
  command->add_option("--resolution", options->resolution, "voxels along the longest side of the workspace")
      ->capture_default_str();
  command->add_option("--frames", options->frames,
                      "A-B, A- (to the end; synthetic: 300 frames) or A (default: the first; videos: all)");
  add_devices(*command, options->devices);
  add_output(
      *command, "--mesh", options->mesh_path,
      "write the mesh (.ply, .obj, .glb, .gltf; -: PLY to standard output); several frames get a number");
  add_output(*command, "--json", options->json_path, "write the measurements (-: standard output)");
  command
      ->add_option("--workspace", options->workspace,
                   "x0,y0,z0,x1,y1,z1 [m] instead of the rig's, or auto: where the silhouettes' cones meet")
      ->delimiter(',');
  add_threshold_flags(*command, options->threshold);
  command->add_option("--slack-px", options->slack_px,
                      "grow silhouettes by so many pixels before they carve");
  command
      ->add_option("--smooth", options->smooth,
                   "steps of smoothing that keep edges and volume; each looks one triangle farther")
      ->capture_default_str();
  command->add_option(
      "--texture", options->texture,
      "colour the mesh from the photos: each vertex (.ply) from its best K cameras; .glb and .gltf get the "
      "photos as an atlas, each triangle from its best");
  add_output(*command, "--texture-views", options->views_path,
             "with --texture: write a picture (.png) of three free views, K = 1 above K");
  command->add_flag("--no-depth", options->no_depth, "silhouettes alone, though the source has depth");
  command->add_flag("--repair-masks", options->repair_masks,
                    "fill holes in the mask of a view that alone carves what all others keep");
  command
      ->add_option("--tolerate-views", options->tolerated_views,
                   "keep what up to so many views carve (k-of-n hull)")
      ->capture_default_str();
  command->add_option("--min-views", options->min_views, "space that fewer cameras look at is outside")
      ->capture_default_str();
  command->add_option("--max-vertices", options->max_vertices,
                      "capacity in the mesh; 0: from the resolution");
  command->add_option("--max-triangles", options->max_triangles,
                      "capacity in the mesh; 0: twice the vertices");
  command->add_option("--max-active-bricks", options->max_active_bricks,
                      "capacity for bricks of 8^3 voxels with surface; 0: from the resolution");
  command
      ->add_option("--depth-jump-m", options->depth_jump_m,
                   "neighbouring depth pixels that differ by more mix two surfaces and are not used [m]")
      ->capture_default_str();
  command->add_flag("--moving", options->moving, "synthetic figures move");
  command->add_option("--depth-cameras", options->depth_cameras, "that film a synthetic figure, 0 to 32")
      ->capture_default_str();
  command->footer(
      "Examples:\n  tactus reconstruct --source synthetic hand --resolution 128 --mesh hand.ply\n"
      "  tactus reconstruct --source middlebury $TACTUS_DATA/middlebury_dino --resolution 256 --json "
      "dino.json\n"
      "  tactus reconstruct --source middlebury $TACTUS_DATA/middlebury_dino --texture 3 --mesh dino.glb\n"
      "  tactus reconstruct --source masks rigs/horseman-masks.yaml --resolution 200 --mesh horseman.ply\n"

      "  tactus reconstruct --source kinect $TACTUS_DATA/azure_kinect_tof --resolution 200 --mesh "
      "capacity.ply");
  command->callback([options] { reconstruct(*options); });
}

}  // namespace tactus
