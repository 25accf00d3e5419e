/// Kalibr camchain: cam0, cam1, ...; T_cn_cnm1 takes points of the camera before to this one, metres. Camera
/// 0 is the world.
#include "tactus/base/error.h"
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool recognise(const Input& input) {
  if (!input.yaml) return false;
  const DataNode* first = input.yaml->find("cam0");
  return first != nullptr && first->is_map() &&
         (first->has("camera_model") || first->has("distortion_model"));
}

Lens lens_of(const DataNode& from) {
  const DataNode& model = from.at("distortion_model");
  if (model.text == "none") return {};
  if (model.text == "radtan") return read_lens(LensModel::brown, from.at("distortion_coeffs"));
  if (model.text == "equidistant") return read_lens(LensModel::fisheye, from.at("distortion_coeffs"));
  model.fail("'" + model.text + "', expected radtan, equidistant or none" +
             (model.text == "fov" ? " (calibrate with --models pinhole-equi)" : ""));
}

std::vector<FileCamera> read(const Input& input, const CalibrationAnswers& answers) {
  known_unit_m(input.path, "Kalibr", 1, answers);
  std::vector<FileCamera> cameras;
  Rigidd T_cam_first;
  for (int i = 0; input.yaml->has("cam" + std::to_string(i)); ++i) {
    const DataNode& from = input.yaml->at("cam" + std::to_string(i));
    const DataNode& model = from.at("camera_model");
    if (model.text != "pinhole") {
      model.fail("'" + model.text +
                 "', expected pinhole: the models omni, ds and eucm are no pinholes with a lens; "
                 "calibrate with --models pinhole-radtan or pinhole-equi");
    }
    FileCamera c;
    Camera& camera = c.calibrated.camera;
    camera.name = from.key;
    const std::vector<double> K = from.at("intrinsics").numbers(4), size = from.at("resolution").numbers(2);
    set_size(camera, image_size(input.path, "Kalibr",
                                Vec2i{static_cast<Index>(size[0]), static_cast<Index>(size[1])}, answers));
    set_intrinsics(camera, {{{K[0], 0, K[2]}, {0, K[1], K[3]}, {0, 0, 1}}}, from.at("intrinsics"));
    c.calibrated.lens = lens_of(from);
    if (i > 0) T_cam_first = read_rigid(from.at("T_cn_cnm1")) * T_cam_first;
    camera.T_cam_world = T_cam_first;
    cameras.push_back(std::move(c));
  }
  return cameras;
}

std::string rows(const Rigidd& T) {
  std::string text;
  for (int i = 0; i < 3; ++i)
    text += "  - " + exact_list(std::vector{T.R(i, 0), T.R(i, 1), T.R(i, 2), T.t[i]}) + "\n";
  return text + "  - [0.0, 0.0, 0.0, 1.0]\n";
}

/// The world becomes that of the first camera: the format knows no other. `name` is beyond the format and
/// harmless.
void write(const std::string& path, std::span<const FileCamera> cameras) {
  refuse_skew("Kalibr", cameras);
  std::string text;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Camera& c = cameras[i].calibrated.camera;
    const Lens& lens = cameras[i].calibrated.lens;
    std::vector<double> d = coefficients(lens);
    if (lens.model == LensModel::brown && d.size() > 4) {
      throw usage_error("Kalibr files hold 4 coefficients of a brown lens, camera '" + c.name + "' has " +
                        std::to_string(d.size()) + "; write opencv or multical");
    }
    text += "cam" + std::to_string(i) + ":\n  camera_model: pinhole\n  distortion_model: " +
            (lens.model == LensModel::none ? "none"
                                           : (lens.model == LensModel::brown ? "radtan" : "equidistant")) +
            "\n  distortion_coeffs: " + exact_list(d) +
            "\n  intrinsics: " + exact_list(std::vector{c.fx_px, c.fy_px, c.cx_px, c.cy_px}) +
            "\n  resolution: [" + std::to_string(c.width_px) + ", " + std::to_string(c.height_px) + "]\n";
    if (i > 0)
      text +=
          "  T_cn_cnm1:\n" + rows(c.T_cam_world * inverse_pose(cameras[i - 1].calibrated.camera.T_cam_world));
  }
  write_text(path, text);
}

}  // namespace

const Format kKalibr{"kalibr", "Kalibr camchain YAML (pinhole with radtan, equidistant or no distortion)",
                     "",       recognise,
                     read,     write};

}  // namespace tactus::calibration
