#include "tactus/rig/calibration_files/formats.h"

#include <charconv>
#include <cmath>
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/base/safe_file.h"
#include "tactus/geom/maths/rotation.h"

namespace tactus::calibration {
namespace {

std::string size_text(Vec2i size) { return std::to_string(size.x) + "x" + std::to_string(size.y); }

}  // namespace

double asked_unit_m(const std::string& file, const char* format, const CalibrationAnswers& answers) {
  if (answers.unit_m) return *answers.unit_m;
  throw usage_error(file + ": " + format + " files do not say their unit of length; give " +
                    answers.unit_name +
                    " (1 for metres, 0.001 for millimetres, the size of a square where that was 1)");
}

double known_unit_m(const std::string& file, const char* format, double unit_m,
                    const CalibrationAnswers& answers) {
  if (answers.unit_m && std::abs(*answers.unit_m / unit_m - 1) > 1e-9) {
    throw usage_error(file + ": " + format + " files have a unit of " + number_text(unit_m) + " m, " +
                      answers.unit_name + " says " + number_text(*answers.unit_m) + "; leave it out");
  }
  return unit_m;
}

Vec2i image_size(const std::string& file, const char* format, std::optional<Vec2i> own,
                 const CalibrationAnswers& answers) {
  if (own && answers.image_size_px && *own != *answers.image_size_px) {
    throw Error(file + ": calibrated for images of " + size_text(*own) + " pixels, " + answers.size_name +
                " is " + size_text(*answers.image_size_px));
  }
  if (!own && !answers.image_size_px) {
    throw usage_error(file + ": " + format +
                      " files do not always say the size of their images, this one does not; give " +
                      answers.size_name);
  }
  const Vec2i size = own ? *own : *answers.image_size_px;
  if (size.x < 1 || size.y < 1 || size.x > 32768 || size.y > 32768)
    throw Error(file + ": an image of " + size_text(size) + " pixels, expected 1 to 32768");
  return size;
}

void set_size(Camera& camera, Vec2i size_px) {
  camera.width_px = size_px.x;
  camera.height_px = size_px.y;
}

void set_intrinsics(Camera& camera, const Mat3d& K, const DataNode& node) {
  if (K(1, 0) != 0 || K(2, 0) != 0 || K(2, 1) != 0 || K(2, 2) != 1 || !(K(0, 0) > 0) || !(K(1, 1) > 0)) {
    std::string text;
    for (int i = 0; i < 9; ++i)
      text += (i == 0 ? "" : (i % 3 == 0 ? "; " : " ")) + number_text(K(i / 3, i % 3));
    node.fail("is [" + text + "], expected [fx s cx; 0 fy cy; 0 0 1] with focal lengths fx, fy > 0");
  }
  camera.fx_px = K(0, 0);
  camera.fy_px = K(1, 1);
  camera.cx_px = K(0, 2);
  camera.cy_px = K(1, 2);
  camera.skew_px = K(0, 1);
}

Lens read_lens(LensModel model, const DataNode& node) {
  try {
    return make_lens(model, node.numbers());
  } catch (const Error& e) {
    if (std::string(e.what()).starts_with(node.file)) throw;
    node.fail(e.what());
  }
}

Lens read_unnamed_lens(const DataNode& node, const CalibrationAnswers& answers) {
  const LensModel model = answers.lens.value_or(LensModel::brown);
  if (model == LensModel::none) return {};
  return read_lens(model, node);
}

Mat3d read_rotation(const DataNode& node) {
  const std::vector<double> v = node.numbers();
  if (v.size() == 3) return rotation_from_vector({v[0], v[1], v[2]});
  if (v.size() == 9) return node.matrix3();
  node.fail("holds " + std::to_string(v.size()) + " numbers, expected 3 (Rodrigues) or 3x3");
}

Vec3d read_vector(const DataNode& node) {
  const std::vector<double> v = node.numbers(3);
  return {v[0], v[1], v[2]};
}

Rigidd read_rigid(const DataNode& node) {
  const std::vector<double> v = node.numbers();
  if (v.size() != 12 && v.size() != 16)
    node.fail("holds " + std::to_string(v.size()) + " numbers, expected a matrix of 4x4 or 3x4");
  if (v.size() == 16 && !(v[12] == 0 && v[13] == 0 && v[14] == 0 && v[15] == 1))
    node.fail("has no last row 0 0 0 1");
  return {{{{v[0], v[1], v[2]}, {v[4], v[5], v[6]}, {v[8], v[9], v[10]}}}, {v[3], v[7], v[11]}};
}

Rigidd inverse_pose(const Rigidd& pose) {
  const Mat3d R = inverse(pose.R);
  return {R, -(R * pose.t)};
}

Rigidd from_opengl_camera_to_world(const Rigidd& T_world_glcam) {
  const Rigidd T = inverse_pose(T_world_glcam);
  return {{{T.R.row[0], -T.R.row[1], -T.R.row[2]}}, {T.t.x, -T.t.y, -T.t.z}};
}

void write_text(const std::string& path, const std::string& text) { write_file(path, text); }

void make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (!std::filesystem::is_directory(path)) throw Error(path + ": can't make this folder");
}

std::string exact(double value) {
  char text[32];
  const auto result = std::to_chars(text, text + sizeof text, value);
  std::string out(text, result.ptr);
  // TOML and YAML tell whole numbers from real ones.
  if (out.find_first_of(".en") == std::string::npos) out += ".0";
  return out;
}

std::string exact_list(std::span<const double> values) {
  std::string out = "[";
  for (const double v : values) out += (out.size() > 1 ? ", " : "") + exact(v);
  return out + "]";
}

std::vector<double> row_major(const Mat3d& M) {
  std::vector<double> v;
  for (int i = 0; i < 9; ++i) v.push_back(M(i / 3, i % 3));
  return v;
}

void refuse_skew(const char* format, std::span<const FileCamera> cameras) {
  for (const FileCamera& c : cameras) {
    if (c.calibrated.camera.skew_px == 0) continue;
    throw usage_error(std::string(format) + " files can't hold the skew of " +
                      number_text(c.calibrated.camera.skew_px) + " px of camera '" +
                      c.calibrated.camera.name + "'; write opencv");
  }
}

void refuse_sphere_lens(const char* format, std::span<const FileCamera> cameras) {
  for (const FileCamera& c : cameras) {
    const LensModel model = c.calibrated.lens.model;
    if (model == LensModel::none || model == LensModel::brown || model == LensModel::fisheye) continue;
    throw usage_error(std::string(format) + " files can't hold the lens '" + lens_name(model) +
                      "' of camera '" + c.calibrated.camera.name + "'; write kalibr");
  }
}

}  // namespace tactus::calibration
