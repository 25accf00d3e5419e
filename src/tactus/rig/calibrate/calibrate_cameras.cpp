#include "tactus/rig/calibrate/calibrate_cameras.h"

#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/rig/calibration_files/calibration_file.h"

namespace tactus {
namespace {

void write_whole(const std::string& path, const std::string& text) {
  SafeFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace

BundleOptions lens_options(const std::string& lens, int coefficients) {
  BundleOptions options;
  if (lens != "brown" && lens != "fisheye")
    throw usage_error("lens '" + lens + "': expected brown or fisheye");
  options.lens = lens == "brown" ? LensModel::brown : LensModel::fisheye;
  if (coefficients != 2 && coefficients != 4 && coefficients != 5 && coefficients != 8)
    throw usage_error("coefficients " + std::to_string(coefficients) + ": expected 2, 4, 5 or 8");
  options.lens_coefficients = coefficients;
  return options;
}

CalibrationReport calibrate_cameras(const Board& board, const BoardPictures& seen,
                                    std::span<const std::string> names,
                                    const CalibrateCamerasOptions& options) {
  BundleOptions bundle = options.bundle;
  std::vector<CalibratedCamera> cameras = options.lenses;
  if (cameras.empty())
    cameras = calibrate_lenses(board, seen.views, names, seen.size_px, bundle);
  else
    bundle.refine_intrinsics = options.refine_lenses;
  CalibrationReport report{
      board, seen.views, seen.picture_count, calibrate_poses(board, seen.views, cameras, bundle), {}};
  if (options.floor)
    report.T_world_first = world_on_board(report.result, *options.floor);
  else if (names.size() > 1)
    report.T_world_first = {{{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}}, {}};
  return report;
}

std::vector<CalibratedCamera> cameras_in_world(const CalibrationReport& report) {
  std::vector<CalibratedCamera> cameras = report.result.cameras;
  for (CalibratedCamera& c : cameras)
    c.camera.T_cam_world = c.camera.T_cam_world * inverse(report.T_world_first);
  return cameras;
}

void write_rig_calibration(const CalibrationReport& report, const std::string& folder,
                           const std::string& page) {
  std::vector<FileCamera> files;
  for (const CalibratedCamera& c : cameras_in_world(report)) files.push_back({c});
  std::filesystem::create_directories(folder);
  write_calibration_file(folder + "/cameras.json", "multical", files);
  write_whole(folder + "/rig.yaml", rig_yaml(report, "cameras.json"));
  write_calibration_page(report, page);
}

void write_lens_calibration(const CalibrationReport& report, const std::string& path) {
  const FileCamera file{report.result.cameras.at(0), false};
  write_calibration_file(path, "opencv", {&file, 1});
}

void write_calibration_page(const CalibrationReport& report, const std::string& path) {
  write_whole(path, calibration_html(report));
}

}  // namespace tactus
