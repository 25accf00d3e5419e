// The paper's pictures (Shao et al. 2019, figures 14 to 20), made here.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/cli/bench/bench_flags.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/output/chart.h"
#include "tactus/cli/output/sheet_colors.h"
#include "tactus/cli/version.h"
#include "tactus/geom/mesh/polygonize.h"
#include "tactus/io/scene_file.h"
#include "tactus/reconstruct/surface_pipeline.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/run/frame_sources.h"
#include "tactus/run/run_pictures.h"
#include "tactus/view/image_files.h"
#include "tactus/view/renderer.h"

namespace tactus {
namespace {

constexpr Index kCell_px = 300;  // of figure 15

/// The surface of a frame, on the device and on the host.
struct Reconstructed {
  SurfacePipeline pipeline;
  TriangleMesh mesh;

  Reconstructed(DeviceSet& devices, const Rig& rig, const FrameSet& frame, Index resolution, bool use_depth,
                int smoothing_steps = 0)
      : pipeline(
            devices, rig.cameras,
            use_depth ? std::span<const Camera>(rig.depth_cameras) : std::span<const Camera>(),
            {.hull = {.workspace_m = rig.workspace_m, .resolution = resolution, .slack_px = rig.slack_px},
             .smoothing_steps = smoothing_steps}) {
    pipeline.make(frame.silhouettes,
                  use_depth ? std::span<const DepthImage>(frame.depths_m) : std::span<const DepthImage>());
    mesh = pipeline.download();
  }
};

FrameSet first_frame(FrameSource& source) {
  FrameSet frame;
  if (source.next(frame) != NextFrame::success) throw Error("no frame: " + source.status());
  return frame;
}

/// The square of a photo that holds its silhouette and a margin.
struct Square {
  Index x0, y0, side;
};
Square square_of(const BitMask& mask) {
  Index x0 = mask.width_px, y0 = mask.height_px, x1 = 0, y1 = 0;
  for (Index y = 0; y < mask.height_px; ++y) {
    for (Index x = 0; x < mask.width_px; ++x) {
      if (!mask(x, y)) continue;
      x0 = std::min(x0, x);
      y0 = std::min(y0, y);
      x1 = std::max(x1, x);
      y1 = std::max(y1, y);
    }
  }
  const Index side = std::max({x1 - x0, y1 - y0, Index{1}}) * 11 / 10;
  return {(x0 + x1 - side) / 2, (y0 + y1 - side) / 2, side};
}

/// Cuts the square out of an image; pixels outside of the image are paper.
ColorImage cut(const ColorImage& image, Square square) {
  ColorImage out(square.side, square.side, {250, 250, 248});
  for (Index y = 0; y < square.side; ++y) {
    for (Index x = 0; x < square.side; ++x) {
      const Index u = square.x0 + x, v = square.y0 + y;
      if (u >= 0 && v >= 0 && u < image.width_px && v < image.height_px) out(x, y) = image(u, v);
    }
  }
  return out;
}

/// A quarter of a turn to the left.
ColorImage turned(const ColorImage& image) {
  ColorImage out(image.height_px, image.width_px);
  for (Index y = 0; y < out.height_px; ++y) {
    for (Index x = 0; x < out.width_px; ++x) out(x, y) = image(image.width_px - 1 - y, x);
  }
  return out;
}

/// Draws the view of a camera of the rig, `scale` times as large as its photo.
class PhotoView {
  static constexpr Index kMarginPx = 100;  // around the photo, since principal points are not in the middle

 public:
  PhotoView(const Camera& camera, Index scale)
      : scale_(scale),
        renderer_({.width_px = scale * (camera.width_px + 2 * kMarginPx),
                   .height_px = scale * (camera.height_px + 2 * kMarginPx),
                   .samples = 4,
                   .shadow_map_px = 2048}) {
    // The world is turned so that the camera looks along -z with y up, as pictures want it.
    const Mat3f R = mat_cast<float>(camera.T_cam_world.R);
    R_view_world_ = {{R.row[0], -R.row[1], -R.row[2]}};
    const Vec3f eye = R_view_world_ * vec_cast<float>(camera.center_world());
    view_ = {.target_m = eye - Vec3f{0, 0, 1}, .distance_m = 1, .azimuth_rad = 0, .elevation_rad = 0};
    view_.fov_rad = static_cast<float>(2 * std::atan((0.5 * camera.height_px + kMarginPx) / camera.fy_px));
    // Pictures have their principal point in the middle.
    shift_px_ = {static_cast<Index>(std::lround(scale * (camera.cx_px - 0.5 * (camera.width_px - 1)))),
                 static_cast<Index>(std::lround(scale * (camera.cy_px - 0.5 * (camera.height_px - 1))))};
  }
  ColorImage draw(ViewMesh mesh, Square square) {
    mesh.R_world_mesh = R_view_world_;
    ViewScene scene;
    scene.ground = false;
    scene.background = kPaper;
    scene.sun = {-0.5F, 0.7F, 0.8F};
    scene.meshes.push_back(std::move(mesh));
    const ColorImage image = renderer_.render(scene, view_);
    return cut(image, {scale_ * (square.x0 + kMarginPx) - shift_px_.x,
                       scale_ * (square.y0 + kMarginPx) - shift_px_.y, scale_ * square.side});
  }

 private:
  Index scale_;
  Renderer renderer_;
  Mat3f R_view_world_ = Mat3f::zero();
  ViewCamera view_;
  Vec2i shift_px_{};
};

/// Photo, mesh, and the mesh textured from all photos but that one. `lies`: photos hold it on its side.
void add_row14(ContactSheet& sheet, DeviceSet& devices, FrameSource& source, std::size_t photo,
               Index resolution, bool lies) {
  constexpr Index kBest = 3;
  const Rig& rig = source.rig();
  const FrameSet frame = first_frame(source);
  const Reconstructed made(devices, rig, frame, resolution, true, 3);
  ExecContext& ctx = devices.context(0);
  std::vector<ColorImage> others = frame.colors;
  others[photo] = {};
  SurfaceTexture texture(ctx, rig.cameras,
                         {.k = kBest,
                          .voxel_size_m = made.pipeline.voxel_size_m(),
                          .center_m = rig.workspace_m.center(),
                          .max_vertices = made.pipeline.surface().positions_m.size(),
                          .fill_steps = 40});
  texture.upload(ctx, others);
  const Camera& camera = rig.cameras[photo];
  texture.shade(ctx, made.pipeline.surface(), made.pipeline.normals(),
                vec_cast<float>(camera.center_world()));
  const auto vertices = static_cast<Index>(made.mesh.positions_m.size());
  const auto photos = std::make_shared<ViewPhotos>(ViewPhotos{.cameras = rig.cameras,
                                                              .images = others,
                                                              .k = kBest,
                                                              .voxel_size_m = made.pipeline.voxel_size_m(),
                                                              .center_m = rig.workspace_m.center()});
  PhotoView view(camera, 2);
  const Square square = square_of(frame.silhouettes[photo]);
  const auto add = [&](const ColorImage& image, const std::string& caption) {
    sheet.add(lies ? turned(image) : image, caption);
  };
  add(cut(frame.colors[photo], square), "photo (" + camera.name + ")");
  add(view.draw({.name = "mesh", .mesh = made.mesh, .material = clay_material()}, square),
      "mesh, " + std::to_string(rig.cameras.size()) + " photos, " + std::to_string(resolution) + " voxels");
  add(view.draw({.name = "textured",
                 .mesh = made.mesh,
                 .colors = to_rgb(to_host(ctx, texture.colors().part(0, vertices))),
                 .photos = photos},
                square),
      "textured from the other " + std::to_string(rig.cameras.size() - 1));
}

ColorImage figure14(DeviceSet& devices) {
  const char* data = std::getenv("TACTUS_DATA");
  if (data == nullptr)
    throw Error(
        "figure 14 shows the Middlebury dino: set TACTUS_DATA to the folder that holds middlebury_dino");
  SourceDescription dino;
  dino.kind = SourceKind::middlebury;
  dino.path = std::string(data) + "/middlebury_dino";
  dino.frames = {0, 0};
  ContactSheet sheet("A figure and a hand: photo, mesh, textured mesh", 6, 3, 260);
  add_row14(sheet, devices, *open_frame_source(dino, {.colors = true}), 1, 256, true);
  SyntheticSource hand({.figure = "hand-still", .colors = true});
  add_row14(sheet, devices, hand, 0, 192, false);
  return sheet.image();
}

/// White to yellow to red to dark, over 0 to 1.
Vec3f heat(float t) {
  static constexpr Vec3f kStops[] = {{0.93F, 0.93F, 0.90F},
                                     {0.99F, 0.85F, 0.35F},
                                     {0.95F, 0.45F, 0.15F},
                                     {0.75F, 0.08F, 0.15F},
                                     {0.30F, 0, 0.20F}};
  const float at = clamp(t, 0.F, 1.F) * 4;
  const auto i = static_cast<std::size_t>(min(at, 3.F));
  const float f = at - static_cast<float>(i);
  return (1 - f) * kStops[i] + f * kStops[i + 1];
}
Rgb8 to_rgb8(Vec3f c) {
  const auto byte = [](float x) { return static_cast<std::uint8_t>(clamp(255 * x + 0.5F, 0.F, 255.F)); };
  return {byte(c.x), byte(c.y), byte(c.z)};
}

/// A scale of errors along the lower edge: its colours in a frame, and the errors of three of them.
void draw_scale(ColorImage& image, float most_m) {
  constexpr float kTextPx = 22;
  const Index x0 = image.width_px / 8, x1 = image.width_px - x0, y1 = image.height_px - 44, y0 = y1 - 20;
  for (Index y = y0 - 2; y < y1 + 2; ++y) {
    for (Index x = x0 - 2; x < x1 + 2; ++x) {
      const bool is_frame = x < x0 || x >= x1 || y < y0 || y >= y1;
      image(x, y) =
          is_frame ? kInk : to_rgb8(heat((static_cast<float>(x - x0) + 0.5F) / static_cast<float>(x1 - x0)));
    }
  }
  for (int tick = 0; tick <= 2; ++tick) {
    const Index x = x0 + tick * (x1 - x0) / 2;
    for (Index y = y1 + 2; y < y1 + 10; ++y) image(x, y) = image(x - 1, y) = kInk;
    const std::string text = number_text(std::round(1e4F * most_m * static_cast<float>(tick) / 2) / 10) +
                             (tick == 2 ? "+ mm" : "");
    const Index wide = text_width_px(text, kTextPx);
    draw_text(image, text, std::min(x - wide / 2, image.width_px - wide - 8), y1 + 38, kTextPx, kInk);
  }
}

/// The truth, the hull of silhouettes and the hull with depth; colours are distances from the truth.
void add_row15(ContactSheet& sheet, DeviceSet& devices, const std::string& figure, float azimuth_rad,
               float elevation_rad, float most_m) {
  SyntheticSource source({.figure = figure + "-still"});
  const FrameSet frame = first_frame(source);
  const Rig& rig = source.rig();
  const FigureShape truth = source.figure().at(frame.time_s);
  Renderer renderer(
      {.width_px = 2 * kCell_px, .height_px = 2 * kCell_px, .samples = 4, .shadow_map_px = 2048});
  ViewScene scene;
  scene.ground = false;
  scene.background = kPaper;
  TriangleMesh exact = polygonize(
      source.figure().bounds_m(), 200, [&](Vec3f p) { return truth.distance_m(p); }, 1);
  compute_normals(exact);
  const ViewCamera view = frame_box(bounds(exact), azimuth_rad, elevation_rad, 1.F);
  scene.meshes.push_back({.name = "truth", .mesh = std::move(exact), .material = clay_material()});
  sheet.add(renderer.render(scene, view), "the " + figure);
  for (const bool use_depth : {false, true}) {
    const Reconstructed made(devices, rig, frame, 128, use_depth);
    ViewMesh shown{.name = "hull", .mesh = made.mesh};
    double squares = 0;
    const Vec3f light = normalized(Vec3f{0.3F, 0.9F, 0.4F});
    for (std::size_t i = 0; i < made.mesh.positions_m.size(); ++i) {
      const float off = std::abs(truth.distance_m(made.mesh.positions_m[i]));
      squares += sqr(static_cast<double>(off));
      // Some shade, so that the shape can be read.
      const float shade = 0.72F + 0.28F * dot(made.mesh.normals[i], light);
      shown.colors.push_back(to_rgb8(shade * heat(off / most_m)));
    }
    scene.meshes = {std::move(shown)};
    ColorImage image = renderer.render(scene, view);
    draw_scale(image, most_m);
    char caption[96];
    std::snprintf(caption, sizeof caption, "%s: RMS %.1f mm", use_depth ? "with depth" : "silhouettes alone",
                  1e3 * std::sqrt(squares / static_cast<double>(made.mesh.positions_m.size())));
    std::printf("%s, %s\n", figure.c_str(), caption);
    sheet.add(image, caption);
  }
}

ColorImage figure15(DeviceSet& devices) {
  ContactSheet sheet("Hull of 8 silhouettes, and with depth: error of the surface", 6, 3, kCell_px);
  add_row15(sheet, devices, "bowl", 0.0F, 0.7F, 0.15F);
  add_row15(sheet, devices, "hand", 0.0F, 0.5F, 0.02F);
  return sheet.image();
}

/// Path of a scene that comes with the program.
std::string find_scene(const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::path bin = fs::read_symlink("/proc/self/exe", error).parent_path(),
                 file = "scenes/" + name + ".yaml";
  const fs::path places[] = {file, bin.parent_path() / file, bin.parent_path() / "share/tactus" / file};
  for (const fs::path& place : places)
    if (fs::exists(place, error)) return place.string();
  throw Error("'" + file.string() + "' is neither below the working directory nor where the program is");
}

/// Runs a scene and shows it at these of its frames, counted from its first.
/// @param close_up shows the last once more from there
void add_moments(ContactSheet& sheet, DeviceSet& devices, const std::string& name,
                 const std::vector<int>& moments, const std::string& what,
                 const std::optional<ViewCameraDescription>& close_up = {}) {
  Scene scene = read_scene(find_scene(name));
  scene.output.video = scene.output.contact_sheet = scene.view.overlay = false;
  const std::unique_ptr<FrameSource> source =
      open_frame_source(scene.source, {.depth = scene.reconstruction.depth});
  const BodyAssets assets = load_body_assets(scene);
  Perception perception(devices, scene, source->rig(), assets);
  World world(devices, scene, assets, &perception);
  RunPictures pictures(scene, source->rig(), assets, world, "", 30);
  if (scene.view.show_models) pictures.show_models(element_triangles(world));
  FrameSet frame;
  double last_s = 0;
  for (int k = 0; k <= moments.back() && source->next(frame) == NextFrame::success; ++k) {
    const double dt_s = k == 0 ? 0 : frame.time_s - last_s;
    world.set_surface(perception.observe(&frame, dt_s));
    world.step(dt_s);
    last_s = frame.time_s;
    if (std::find(moments.begin(), moments.end(), k) == moments.end()) continue;
    pictures.add(world.snapshot(), {}, "", "");
    char caption[64];
    std::snprintf(caption, sizeof caption, "%s, %.2f s", what.c_str(), frame.time_s);
    sheet.add(pictures.picture(), caption);
    if (!close_up || k != moments.back()) continue;
    scene.view.camera = *close_up;
    RunPictures near(scene, source->rig(), assets, world, "", 30);
    near.add(world.snapshot(), {}, "", "");
    sheet.add(near.picture(), "the incision");
  }
}

/// View of figures 18 and 19: the middle of the incision.
ViewCameraDescription incision_view() {
  ViewCameraDescription camera;
  camera.target_m = {0.075, 0.437, 0.01};
  camera.distance_m = 0.15;
  camera.azimuth_deg = 120;
  camera.elevation_deg = 50;
  return camera;
}

ColorImage figure16(DeviceSet& devices) {
  ContactSheet sheet("A rabbit of elements (red) and shape matching (blue)", 3, 3, 480);
  add_moments(sheet, devices, "fig16-rabbit", {30, 45, 60}, "6 : 4");
  return sheet.image();
}

ColorImage figure17(DeviceSet& devices) {
  ContactSheet sheet("What cameras see touches what is soft", 6, 3, 480);
  add_moments(sheet, devices, "fig17-rabbit", {0, 36, 60}, "a real rabbit and a soft one");
  add_moments(sheet, devices, "fig17-hand", {0, 50, 70}, "a real hand and a soft rabbit");
  return sheet.image();
}

ColorImage figure18(DeviceSet& devices) {
  ContactSheet sheet("A real scalpel cuts a soft liver", 4, 2, 640);
  add_moments(sheet, devices, "fig18-scalpel", {6, 12, 60}, "held at one end", incision_view());
  return sheet.image();
}

ColorImage figure19(DeviceSet& devices) {
  ContactSheet sheet("A real scalpel cuts a soft liver, which bleeds", 4, 2, 640);
  add_moments(sheet, devices, "fig19-bleeding", {6, 15, 60}, "held at one end", incision_view());
  return sheet.image();
}

/// Measurements of `tactus-bench`, made here and now; its table goes to standard error.
nlohmann::json bench_rows(const std::string& name, const std::string& devices) {
  const std::string command =
      "'" + bench_program() + "' bench " + name + " --devices '" + devices + "' --json -";
  const auto close = [](FILE* f) { pclose(f); };
  std::unique_ptr<FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
  if (pipe == nullptr) throw Error("can't run " + command);
  std::string text;
  char part[4096];
  while (const std::size_t n = std::fread(part, 1, sizeof part, pipe.get())) text.append(part, n);
  if (pclose(pipe.release()) != 0) throw Error("failed: " + command);
  return nlohmann::json::parse(text).at("rows");
}

/// Times of a substep over the body's nodes, as they are measured here and now.
ColorImage figure20(const DeviceSet& devices) {
  Chart chart{.title = "A substep of a body of elements and shape matching",
              .remark = machine_text() + ", " + devices.name(),
              .x_name = "nodes",
              .y_name = "ms",
              .series = {{"7 : 3, elements to shape matching", {178, 42, 46}, {}},
                         {"3 : 7", {40, 96, 168}, {}},
                         {"3 : 7, matched every 4th substep", {120, 170, 216}, {}}}};
  constexpr const char* kNames[] = {"fig20 7:3", "fig20 3:7", "fig20 3:7, matched every 4th"};
  for (const nlohmann::json& row : bench_rows("fig20", devices.name()))
    for (std::size_t s = 0; s < chart.series.size(); ++s)
      if (row["name"] == kNames[s]) chart.series[s].points.emplace_back(row["size"], row["ms_p50"]);
  return draw_chart(chart);
}

ColorImage figure(const std::string& which, DeviceSet& devices) {
  if (which == "fig20") return figure20(devices);

  if (which == "fig14") return figure14(devices);
  if (which == "fig15") return figure15(devices);
  if (which == "fig18") return figure18(devices);
  if (which == "fig19") return figure19(devices);
  return which == "fig16" ? figure16(devices) : figure17(devices);
}

}  // namespace

void add_paper_command(CLI::App& app) {
  struct Options {
    std::string which, path, devices = "auto";
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("paper", "Make a figure of the paper");
  command->add_option("which", options->which, "fig14, fig15, fig16, fig17, fig18, fig19 or fig20")
      ->required();
  add_output(*command, "--out", options->path, "picture to write (.png)")->required();
  add_devices(*command, options->devices);
  command->footer("Example:\n  tactus paper fig15 --out fig15.png");
  command->callback([options] {
    static const std::string kKnown[] = {"fig14", "fig15", "fig16", "fig17", "fig18", "fig19", "fig20"};
    if (std::find(std::begin(kKnown), std::end(kKnown), options->which) == std::end(kKnown))
      throw usage_error("'" + options->which + "' is no figure" + suggestion(options->which, kKnown));
    output_is_writable(options->path);
    DeviceSet devices(options->devices);
    write_png(options->path, figure(options->which, devices));
  });
}

}  // namespace tactus
