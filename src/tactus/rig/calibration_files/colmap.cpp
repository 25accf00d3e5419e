#include "tactus/rig/calibration_files/colmap.h"
#include "tactus/rig/images/numbered_files.h"

#include <cmath>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/geom/maths/rotation.h"

namespace tactus::calibration {
namespace {

namespace fs = std::filesystem;

constexpr ColmapModel kColmapModels[] = {{0, "SIMPLE_PINHOLE", 3},
                                         {1, "PINHOLE", 4},
                                         {2, "SIMPLE_RADIAL", 4},
                                         {3, "RADIAL", 5},
                                         {4, "OPENCV", 8},
                                         {5, "OPENCV_FISHEYE", 8},
                                         {6, "FULL_OPENCV", 12},
                                         {7, "FOV", 5},
                                         {8, "SIMPLE_RADIAL_FISHEYE", 4},
                                         {9, "RADIAL_FISHEYE", 5},
                                         {10, "THIN_PRISM_FISHEYE", 12}};

}  // namespace

const ColmapModel* colmap_model(int id) {
  for (const ColmapModel& m : kColmapModels) {
    if (m.id == id) return &m;
  }
  return nullptr;
}
const ColmapModel* colmap_model(const std::string& name) {
  for (const ColmapModel& m : kColmapModels) {
    if (m.name == name) return &m;
  }
  return nullptr;
}

CalibratedCamera colmap_camera(const ColmapModel& model, Vec2i size_px, std::span<const double> p,
                               const std::string& where) {
  const std::string name = model.name;
  if (name == "FOV" || name == "THIN_PRISM_FISHEYE")
    throw Error(where + ": the camera model " + name +
                " is not known here; choose OPENCV or OPENCV_FISHEYE in COLMAP");
  for (const double v : p) {
    if (!std::isfinite(v)) throw Error(where + ": a parameter of the camera is not a finite number");
  }
  CalibratedCamera c;
  set_size(c.camera, size_px);
  // One focal length, or two.
  const bool one = name.starts_with("SIMPLE_") || name.starts_with("RADIAL");
  c.camera.fx_px = p[0];
  c.camera.fy_px = one ? p[0] : p[1];
  c.camera.cx_px = p[one ? 1 : 2] - 0.5;
  c.camera.cy_px = p[one ? 2 : 3] - 0.5;
  const std::span<const double> rest = p.subspan(one ? 3 : 4);
  if (rest.empty()) return c;
  std::vector<double> k(rest.begin(), rest.end());
  const bool fisheye = name.ends_with("FISHEYE");
  if (fisheye) {
    k.resize(4);
  } else if (k.size() == 1) {
    k.resize(2);
  }
  c.lens = make_lens(fisheye ? LensModel::fisheye : LensModel::brown, k);
  return c;
}

std::vector<FileCamera> colmap_rig(const std::map<std::uint32_t, CalibratedCamera>& lenses,
                                   std::span<const ColmapImage> images, const std::string& path,
                                   const CalibrationAnswers& answers) {
  const double unit_m = asked_unit_m(path, "COLMAP", answers);
  std::vector<FileCamera> cameras;
  for (const ColmapImage& image : images) {
    const auto lens = lenses.find(image.camera_id);
    if (lens == lenses.end()) {
      throw Error(path + ": image '" + image.name + "' was taken by camera " +
                  std::to_string(image.camera_id) + ", which the cameras file does not have");
    }
    FileCamera c{lens->second};
    c.calibrated.camera.name = fs::path(image.name).replace_extension("").string();
    const double* q = image.q_wxyz;
    const double length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(std::abs(length2 - 1) < 1e-2))
      throw Error(path + ": image '" + image.name + "': its quaternion is no rotation");
    c.calibrated.camera.T_cam_world = {rotation_from_quaternion(q[0], q[1], q[2], q[3]), unit_m * image.t};
    image_size(path, "COLMAP", Vec2i{c.calibrated.camera.width_px, c.calibrated.camera.height_px}, answers);
    cameras.push_back(std::move(c));
  }
  return cameras;
}

std::string colmap_folder(const Input& input, const char* extension) {
  const fs::path path(input.path);
  const std::string cameras = std::string("cameras") + extension, images = std::string("images") + extension;
  const bool is_part = !input.is_folder && (path.filename() == cameras || path.filename() == images);
  if (!input.is_folder && !is_part) return "";
  const fs::path folder = input.is_folder ? path : path.parent_path();
  return is_file(folder / cameras) || is_part ? (folder.empty() ? std::string(".") : folder.string()) : "";
}

}  // namespace tactus::calibration
