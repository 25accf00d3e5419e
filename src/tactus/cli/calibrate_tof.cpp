#include "tactus/cli/calibrate_tof.h"

#include <cmath>
#include <cstdio>
#include <sstream>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/base/safe_file.h"
#include "tactus/rig/calibration_files/calibration_file.h"
#include "tactus/rig/images/depth_error.h"
#include "tactus/rig/images/depth_images.h"
#include "tactus/rig/images/numbered_files.h"

namespace tactus {
namespace {

struct TofOptions {
  std::string depth, planes, lens, camera, out;
  double unit_m = 1e-3, lens_unit_m = 1;
  bool radial = false;
};

/// A flat target: normal . p = distance_m in the camera's frame.
struct Plane {
  int picture = 0;
  Vec3d normal;
  double distance_m = 0;
};

std::vector<Plane> read_planes(const std::string& file) {
  std::istringstream in(read_text(file, kMaxYamlBytes));
  std::vector<Plane> planes;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    std::istringstream words(line);
    Plane p;
    if (!(words >> p.picture >> p.normal.x >> p.normal.y >> p.normal.z >> p.distance_m) ||
        !(length(p.normal) > 0)) {
      throw Error(file + ":" + std::to_string(number) +
                  ": expected PICTURE NX NY NZ D: the target is n.p = D [m] in the camera's frame (x right, "
                  "y down, z forward)");
    }
    const double scale = 1 / length(p.normal);
    p.normal = scale * p.normal;
    p.distance_m *= scale;
    planes.push_back(p);
  }
  if (planes.size() < 2)
    throw Error(file + ": " + std::to_string(planes.size()) +
                " planes, expected at least 2 at different distances");
  return planes;
}

/// Every third pixel that measured something within a quarter of the truth; others see something else than
/// the target.
void add_samples(const TofOptions& options, const CalibratedCamera& lens, const Plane& plane,
                 const std::string& file, std::vector<DepthSample>& samples) {
  const Camera& c = lens.camera;
  const Image<std::uint16_t> raw = read_depth_png(file, c.width_px, c.height_px);
  for (Index v = 0; v < c.height_px; v += 3) {
    for (Index u = 0; u < c.width_px; u += 3) {
      if (raw(u, v) == 0) continue;
      const double y = (v - c.cy_px) / c.fy_px;
      const auto ideal = lens.lens.undistort({(u - c.cx_px - c.skew_px * y) / c.fx_px, y});
      if (!ideal) continue;
      const Vec3d ray{ideal->x, ideal->y, 1};
      const double z_m = plane.distance_m / dot(plane.normal, ray);
      const double true_m = z_m * length(ray),
                   measured_m = options.unit_m * raw(u, v) * (options.radial ? 1 : length(ray));
      if (z_m > 0 && std::abs(measured_m - true_m) < 0.25 * true_m)
        samples.push_back({static_cast<double>(u), static_cast<double>(v), measured_m, true_m});
    }
  }
}

double rms_mm(std::span<const DepthSample> samples, const DepthErrorTable* table) {
  double sum = 0;
  for (const DepthSample& s : samples)
    sum += std::pow(
        s.measured_m - (table != nullptr ? table->error_m(s.u_px, s.v_px, s.measured_m) : 0) - s.true_m, 2);
  return 1e3 * std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, samples.size())));
}

void calibrate_tof(const TofOptions& options) {
  output_is_writable(options.out);
  const std::vector<Plane> planes = read_planes(options.planes);
  CalibrationAnswers answers;
  CalibrationData data;
  answers.unit_m = options.lens_unit_m;
  data = read_calibration_file(options.lens, answers);
  for (FileCamera& camera : data.cameras) camera.has_pose = true;
  const CalibratedCamera lens = camera_of(data, options.camera, options.lens).calibrated;
  const NumberedFiles files(options.depth);
  std::vector<DepthSample> fitted, held_out;
  for (std::size_t i = 0; i < planes.size(); ++i) {
    // Every fifth picture checks the result and takes no part in it.
    auto& samples = planes.size() >= 10 && i % 5 == 2 ? held_out : fitted;
    add_samples(options, lens, planes[i], files.file(planes[i].picture), samples);
  }
  const DepthErrorTable table = fit_depth_error(fitted, {lens.camera.width_px, lens.camera.height_px});
  std::printf("%zu measurements of %zu pictures: RMS %.2f mm before, %.2f mm after\n",
              fitted.size() + held_out.size(), planes.size(), rms_mm(fitted, nullptr),
              rms_mm(fitted, &table));
  if (!held_out.empty()) {
    std::printf("held out (%zu): RMS %.2f mm before, %.2f mm after\n", held_out.size(),
                rms_mm(held_out, nullptr), rms_mm(held_out, &table));
  }
  write_depth_error(options.out, table);
  std::printf("written: %s (rig file: depth_cameras[].error_table)\n", options.out.c_str());
}

}  // namespace

void add_calibrate_tof(CLI::App& calibrate) {
  auto options = std::make_shared<TofOptions>();
  CLI::App* tof =
      calibrate.add_subcommand("tof", "Distance error of a time-of-flight camera, from a flat target");
  tof->add_option("--depth", options->depth, "16-bit PNG of the target, a pattern with one %d")->required();
  tof->add_option("--planes", options->planes,
                  "text: per picture its number and the target's plane NX NY NZ D [m]")
      ->required();
  tof->add_option("--lens", options->lens, "calibration of the depth camera, of any format")->required();
  tof->add_option("--camera", options->camera, "its name, where the calibration has several");
  tof->add_option("--lens-unit-m", options->lens_unit_m,
                  "unit of that calibration, which does not matter for a lens");
  tof->add_option("--unit-m", options->unit_m, "metres per unit of the images")->capture_default_str();
  tof->add_flag("--radial", options->radial, "the images hold distance from the camera, not along its axis");
  tof->add_option("--out", options->out, "JSON with the table")->required();
  tof->footer(
      "Example:\n  tactus calibrate tof --depth wall_%02d.png --planes planes.txt --lens tof.yaml --out "
      "tof_error.json");
  tof->callback([options] { calibrate_tof(*options); });
}

}  // namespace tactus
