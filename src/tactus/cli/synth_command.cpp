#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/safe_file.h"
#include "tactus/base/timing.h"
#include "tactus/cli/commands.h"
#include "tactus/cli/interrupt.h"
#include "tactus/geom/mesh/mesh_defects.h"
#include "tactus/io/json_file.h"
#include "tactus/io/mesh/mesh_file.h"
#include "tactus/rig/data_writers.h"
#include "tactus/rig/synthetic/synthetic_noise.h"
#include "tactus/rig/synthetic/synthetic_source.h"
#include "tactus/rig/synthetic/synthetic_subject.h"
#include "tactus/run/progress_text.h"
#include "tactus/view/image_files.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

struct SynthOptions {
  std::string what, folder;
  int frames = 1;
  double fps = 30, turns_per_s = 0;
  std::optional<double> size_m;
  bool moving = false, no_colors = false;
  SyntheticRigOptions rig;
  NoiseOptions noise;
};

std::unique_ptr<SyntheticSubject> make_subject(const SynthOptions& options) {
  if (!fs::path(options.what).has_extension()) {
    if (options.turns_per_s != 0)
      throw usage_error("--turns moves meshes; figures have their own motion (--moving)");
    if (options.size_m) throw usage_error("--size is of meshes; figures have their own");
    return make_figure_subject(options.what, options.moving);
  }
  if (options.moving) throw usage_error("--moving moves figures; meshes turn (--turns)");
  TriangleMesh mesh = import_mesh(options.what).mesh;
  if (const EdgeDefects edges = find_edge_defects(mesh); !edges.bounds_solid())
    log_warning("'" + options.what + "' does not bound a solid: " + edges.text() +
                "; the volumes in truth.json mean nothing");
  return make_mesh_subject(std::move(mesh), options.size_m.value_or(0.8), options.turns_per_s);
}

void check(const SynthOptions& options) {
  check_noise(options.noise);
  if (options.frames < 1 || options.frames > 9999)
    throw usage_error("--frames " + std::to_string(options.frames) + ": expected 1 to 9999");
  if (!(options.fps > 0 && options.fps <= 1e4))
    throw usage_error("--fps " + std::to_string(options.fps) + ": expected above 0 to 10000");
}

void check_is_empty(const std::string& folder) {
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename() != FolderLock::kName)
      throw usage_error("--out '" + folder + "' is not an empty folder");
  }
}

std::string file_of(const std::string& stem, int frame, const char* extension) {
  char number[16];
  std::snprintf(number, sizeof number, "_%04d", frame);
  return stem + number + extension;
}

/// Vertices with velocity and paint: `vx vy vz` are m/s.
void write_truth(const std::string& path, const SyntheticSubject& subject, double time_s) {
  const TriangleMesh mesh = subject.surface(time_s);
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\ncomment metres and metres per second\nelement vertex " +
      std::to_string(mesh.positions_m.size()) + "\n";
  for (const char* name : {"x", "y", "z", "vx", "vy", "vz"})
    bytes += std::string("property float ") + name + "\n";
  for (const char* name : {"red", "green", "blue"}) bytes += std::string("property uchar ") + name + "\n";
  bytes += "element face " + std::to_string(mesh.triangles.size()) +
           "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto append = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (const Vec3f p : mesh.positions_m) {
    append(p);
    append(subject.velocity_m_s(p, time_s));
    append(subject.paint(p, time_s));
  }
  for (const auto& triangle : mesh.triangles) {
    append(std::uint8_t{3});
    append(triangle);
  }
  write_file(path, bytes);
}

/// The camera's photograph of the subject: paint before a dark grey wall.
ColorImage photograph(const SyntheticSubject& subject, const Camera& camera, const DepthImage& distance_m,
                      double time_s) {
  ColorImage image(camera.width_px, camera.height_px, Rgb8{40, 40, 44});
  const Vec3d eye = camera.center_world();
  for (Index y = 0; y < camera.height_px; ++y) {
    for (Index x = 0; x < camera.width_px; ++x) {
      const auto d = static_cast<double>(distance_m(x, y));
      if (d > 0)
        image(x, y) = subject.paint(vec_cast<float>(eye + d * pixel_ray_world(camera, x, y)), time_s);
    }
  }
  return image;
}

/// @param frames that were written
void write_rig(const SynthOptions& options, const Rig& rig, int frames) {
  char text[256];
  std::snprintf(
      text, sizeof text,
      "unit_m: 1\nup: +y\nimage_size_px: [%d, %d]\n"
      "workspace_m: {min: [-0.5, 0, -0.5], max: [0.5, 1, 0.5]}\nframes: [0, %d]\nframes_per_s: %.9g\n",
      options.rig.width_px, options.rig.height_px, frames - 1, options.fps);
  std::string yaml = "# Made by tactus synth; the truth lies in truth/.\n" + std::string(text) + "cameras:\n";
  for (const Camera& camera : rig.cameras) {
    const std::string& name = camera.name;
    yaml += "  - name: " + name + "\n    calibration: cameras/" + name + ".yaml\n    mask: masks/" + name +
            "_%04d.png\n";
    if (!options.no_colors) yaml += "    photo: photos/" + name + "_%04d.png\n";
  }
  if (!rig.depth_cameras.empty()) yaml += "depth_cameras:\n";
  for (const Camera& camera : rig.depth_cameras) {
    const std::string& name = camera.name;
    yaml += "  - name: " + name + "\n    calibration: cameras/" + name + ".yaml\n    depth: depth/" + name +
            "_%04d.png\n    image_size_px: [" + std::to_string(camera.width_px) + ", " +
            std::to_string(camera.height_px) + "]\n    unit_m: 0.0001\n    distance: radial\n";
  }
  write_file(options.folder + "/rig.yaml", yaml);
}

/// One tick: every camera at its own moment.
nlohmann::json write_frame(const SynthOptions& options, const SyntheticSubject& subject, const Rig& rig,
                           int frame) {
  const double time_s = frame / options.fps;
  const std::string& folder = options.folder;
  BitMask mask;
  DepthImage distance_m;
  nlohmann::json late = nlohmann::json::array();
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    const Camera& camera = rig.cameras[c];
    const double late_s = sync_error_s(options.noise, static_cast<int>(c), frame), then_s = time_s + late_s;
    late.push_back(late_s);
    subject.see(camera, then_s, mask, distance_m);
    if (!options.no_colors)
      write_png(file_of(folder + "/photos/" + camera.name, frame, ".png"),
                photograph(subject, camera, distance_m, then_s));
    disturb_mask(mask, options.noise, static_cast<int>(c), frame);
    write_mask(file_of(folder + "/masks/" + camera.name, frame, ".png"), mask);
  }
  for (std::size_t d = 0; d < rig.depth_cameras.size(); ++d) {
    const Camera& camera = rig.depth_cameras[d];
    const auto number = static_cast<int>(rig.cameras.size() + d);
    late.push_back(sync_error_s(options.noise, number, frame));
    subject.see(camera, time_s + late.back().get<double>(), mask, distance_m);
    write_depth(file_of(folder + "/truth/depth/" + camera.name, frame, ".png"), distance_m);
    disturb_depth(distance_m, options.noise, number, frame);
    write_depth(file_of(folder + "/depth/" + camera.name, frame, ".png"), distance_m);
  }
  write_truth(file_of(folder + "/truth/surface", frame, ".ply"), subject, time_s);
  return {{"frame", frame},
          {"time_s", time_s},
          {"volume_m3", subject.volume_m3(time_s)},
          {"camera_late_s", std::move(late)}};
}

/// Folders and calibrations, which don't depend on time.
void write_still(const SynthOptions& options, const Rig& rig) {
  for (const char* part : {"masks", "photos", "depth", "cameras", "truth/cameras", "truth/depth"}) {
    std::error_code error;
    fs::create_directories(fs::path(options.folder) / part, error);
    if (error) throw Error("'" + options.folder + "' can't be made: " + error.message());
  }
  for (std::size_t c = 0; c < rig.cameras.size() + rig.depth_cameras.size(); ++c) {
    const std::size_t colors = rig.cameras.size();
    const Camera& camera = c < colors ? rig.cameras[c] : rig.depth_cameras[c - colors];
    write_calibration(options.folder + "/truth/cameras/" + camera.name + ".yaml", camera);
    write_calibration(options.folder + "/cameras/" + camera.name + ".yaml",
                      miscalibrate(camera, options.noise, static_cast<int>(c)));
  }
}

nlohmann::json truth_before_frames(const SynthOptions& options, const Box3f& box) {
  return {
      {"what", options.what},
      {"bounds_m", {{"min", {box.min.x, box.min.y, box.min.z}}, {"max", {box.max.x, box.max.y, box.max.z}}}},
      {"depth_unit_m", 1e-4},
      {"noise",
       {{"calibration_px", options.noise.calibration_px},
        {"sync_ms", options.noise.sync_ms},
        {"segmentation_px", options.noise.segmentation_px},
        {"depth_m", options.noise.depth_m},
        {"wiggle_m", options.noise.wiggle_m},
        {"seed", options.noise.seed}}},
      {"frames", nlohmann::json::array()}};
}

/// One line at a terminal, as those of a run.
void show_progress(int done, int total, double elapsed_s) {
  const std::string text = progress_text(done, total, elapsed_s);
  log_debug(text);
  if (isatty(STDERR_FILENO) == 0 || log_level() != LogLevel::info) return;
  std::fprintf(stderr, "\r%s\033[K%s", text.c_str(), done == total || interrupted() ? "\n" : "");
}

void synthesize(const SynthOptions& options) {
  check(options);
  const std::unique_ptr<SyntheticSubject> subject = make_subject(options);
  const Rig rig = make_synthetic_rig(options.rig);
  const FolderLock lock(options.folder);
  check_is_empty(options.folder);
  write_still(options, rig);
  nlohmann::json truth = truth_before_frames(options, subject->bounds_m());
  const auto finish = [&] {
    const auto written = static_cast<int>(truth["frames"].size());
    write_json_file(options.folder + "/truth/truth.json", truth);
    if (written > 0) write_rig(options, rig, written);  // last: a folder with a rig file is whole
    std::printf("%d frames of %zu cameras and %zu depth cameras in %s\n", written, rig.cameras.size(),
                rig.depth_cameras.size(), options.folder.c_str());
  };
  FramePatience patience(finish);
  const double begin_s = now_s();
  for (int k = 0; k < options.frames && !interrupted(); ++k) {
    patience.begin();
    nlohmann::json row = write_frame(options, *subject, rig, k);
    patience.end();
    truth["frames"].push_back(std::move(row));
    show_progress(k + 1, options.frames, now_s() - begin_s);
  }
  finish();
}

}  // namespace

void add_synth_command(CLI::App& app) {
  auto options = std::make_shared<SynthOptions>();
  CLI::App* command = app.add_subcommand(
      "synth", "Write a data set with ground truth: masks, photos, depth, cameras, surfaces with velocities");
  command
      ->add_option("what", options->what, "built-in figure, or a closed mesh (.ply, .obj, .stl, .off, .glb)")
      ->required();
  command->add_option("--out", options->folder, "folder to make")->required();
  command->add_option("--frames", options->frames, "how many")->capture_default_str();
  command->add_option("--fps", options->fps, "frames a second")->capture_default_str();
  command->add_flag("--moving", options->moving, "figures move");
  command->add_option("--size", options->size_m, "longest side of a mesh [m], 0.8 by default");
  command->add_option("--turns", options->turns_per_s, "turns of a mesh about the vertical, a second");
  command->add_option("--cameras", options->rig.camera_count, "in a ring around the workspace")
      ->capture_default_str();
  command->add_option("--depth-cameras", options->rig.depth_cameras, "time-of-flight, 0 to 32")
      ->capture_default_str();
  command->add_flag("--no-colors", options->no_colors, "leave the photos out");
  NoiseOptions& noise = options->noise;
  command->add_option("--noise-calibration", noise.calibration_px, "wrong directions of view [px]");
  command->add_option("--noise-sync", noise.sync_ms, "cameras early or late [ms]");
  command->add_option("--noise-segmentation", noise.segmentation_px, "contours moved in and out [px]");
  command->add_option("--noise-depth", noise.depth_m, "of distances at 1 m [m]");
  command->add_option("--noise-wiggle", noise.wiggle_m, "amplitude of the distances' systematic error [m]");
  command->add_option("--seed", noise.seed, "of the noise")->capture_default_str();
  command->footer(
      "Examples:\n  tactus synth hand --moving --frames 30 --out hand30\n"
      "  tactus synth bunny.ply --turns 1 --frames 30 --noise-segmentation 1 --out bunny30\n"
      "  tactus reconstruct --source masks hand30/rig.yaml --frames 0- --texture 3 --mesh hand.ply");
  command->callback([options] { synthesize(*options); });
}

}  // namespace tactus
