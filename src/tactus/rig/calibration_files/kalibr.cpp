/// Kalibr camchain: cam0, cam1, ...; T_cn_cnm1 takes points of the camera before to this one, metres. Camera
/// 0 is the world. Intrinsics: pinhole fu fv pu pv; omni xi and these; eucm alpha beta and these; ds xi alpha
/// and these.
#include <algorithm>
#include <array>

#include "tactus/base/error.h"
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool recognise_kalibr(const Input& input) {
  if (!input.yaml) return false;
  const DataNode* first = input.yaml->find("cam0");
  return first != nullptr && first->is_map() &&
         (first->has("camera_model") || first->has("distortion_model"));
}

/// The name of a model, and how many numbers stand before its focal lengths.
struct Model {
  const char* name;
  LensModel lens;
  std::size_t before;
};
constexpr Model kPinhole{"pinhole", LensModel::none, 0};
constexpr std::array kKalibrModels{kPinhole, Model{"omni", LensModel::omni, 1},
                                   Model{"eucm", LensModel::eucm, 2},
                                   Model{"ds", LensModel::double_sphere, 2}};

const Model& model_of(const DataNode& node) {
  const auto* at = std::ranges::find(kKalibrModels, node.text, &Model::name);
  if (at == kKalibrModels.end()) node.fail("'" + node.text + "', expected pinhole, omni, eucm or ds");
  return *at;
}

/// Coefficients of radtan behind a sphere; none: four zeros.
std::vector<double> radtan_of(const DataNode& from) {
  const DataNode& model = from.at("distortion_model");
  if (model.text == "none") return std::vector<double>(4);
  if (model.text != "radtan") model.fail("'" + model.text + "', expected radtan or none of an omni camera");
  return from.at("distortion_coeffs").numbers(4);
}

Lens pinhole_lens(const DataNode& from) {
  const DataNode& model = from.at("distortion_model");
  if (model.text == "none") return {};
  if (model.text == "radtan") return read_lens(LensModel::brown, from.at("distortion_coeffs"));
  if (model.text == "equidistant") return read_lens(LensModel::fisheye, from.at("distortion_coeffs"));
  model.fail("'" + model.text + "', expected radtan, equidistant or none" +
             (model.text == "fov" ? " (calibrate with --models pinhole-equi)" : ""));
}

Lens lens_of(const Model& model, const DataNode& from, const std::vector<double>& intrinsics) {
  if (model.lens == LensModel::none) return pinhole_lens(from);
  std::vector<double> k(intrinsics.begin(), intrinsics.begin() + static_cast<std::ptrdiff_t>(model.before));
  if (model.lens == LensModel::omni) {
    const std::vector<double> radtan = radtan_of(from);
    k.insert(k.begin(), radtan.begin(), radtan.end());
  } else if (const DataNode& d = from.at("distortion_model"); d.text != "none") {
    d.fail("'" + d.text + "', expected none of a camera_model '" + model.name + "'");
  }
  try {
    return make_lens(model.lens, k);
  } catch (const Error& e) {
    from.at("intrinsics").fail(e.what());
  }
}

/// Kalibr's focal lengths over those of the picture's middle (lens.h).
double focal_scale(const Lens& lens) {
  if (lens.model == LensModel::omni) return 1 + lens.k[4];
  return lens.model == LensModel::double_sphere ? 1 + lens.k[0] : 1;
}

std::vector<FileCamera> read_kalibr(const Input& input, const CalibrationAnswers& answers) {
  known_unit_m(input.path, "Kalibr", 1, answers);
  std::vector<FileCamera> cameras;
  Rigidd T_cam_first;
  for (int i = 0; input.yaml->has("cam" + std::to_string(i)); ++i) {
    const DataNode& from = input.yaml->at("cam" + std::to_string(i));
    const Model& model = model_of(from.at("camera_model"));
    FileCamera c;
    Camera& camera = c.calibrated.camera;
    camera.name = from.key;
    const std::vector<double> K = from.at("intrinsics").numbers(model.before + 4),
                              size = from.at("resolution").numbers(2);
    set_size(camera, image_size(input.path, "Kalibr",
                                Vec2i{static_cast<Index>(size[0]), static_cast<Index>(size[1])}, answers));
    c.calibrated.lens = lens_of(model, from, K);
    const double scale = focal_scale(c.calibrated.lens), *f = &K[model.before];
    set_intrinsics(camera, {{{f[0] / scale, 0, f[2]}, {0, f[1] / scale, f[3]}, {0, 0, 1}}},
                   from.at("intrinsics"));
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

/// Model, distortion and intrinsics of one camera.
std::string lens_text(const Camera& c, const Lens& lens) {
  std::vector<double> d = coefficients(lens), K;
  const Model* model = std::ranges::find(kKalibrModels, lens.model, &Model::lens);
  if (model == kKalibrModels.end()) model = &kPinhole;
  const char* distortion = "none";
  if (model->before > 0) {
    K.assign(d.end() - static_cast<std::ptrdiff_t>(model->before), d.end());
    d.resize(d.size() - model->before);
    if (!d.empty()) distortion = "radtan";
  } else if (lens.model != LensModel::none) {
    distortion = lens.model == LensModel::brown ? "radtan" : "equidistant";
  }
  if (lens.model == LensModel::brown && d.size() > 4) {
    throw usage_error("Kalibr files hold 4 coefficients of a brown lens, camera '" + c.name + "' has " +
                      std::to_string(d.size()) + "; write opencv or multical");
  }
  const double scale = focal_scale(lens);
  K.insert(K.end(), {scale * c.fx_px, scale * c.fy_px, c.cx_px, c.cy_px});
  return std::string("  camera_model: ") + model->name + "\n  distortion_model: " + distortion +
         "\n  distortion_coeffs: " + exact_list(d) + "\n  intrinsics: " + exact_list(K) + "\n";
}

/// The world becomes that of the first camera: the format knows no other. `name` is beyond the format and
/// harmless.
void write_kalibr(const std::string& path, std::span<const FileCamera> cameras) {
  refuse_skew("Kalibr", cameras);
  std::string text;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Camera& c = cameras[i].calibrated.camera;
    text += "cam" + std::to_string(i) + ":\n" + lens_text(c, cameras[i].calibrated.lens) + "  resolution: [" +
            std::to_string(c.width_px) + ", " + std::to_string(c.height_px) + "]\n";
    if (i > 0)
      text +=
          "  T_cn_cnm1:\n" + rows(c.T_cam_world * inverse_pose(cameras[i - 1].calibrated.camera.T_cam_world));
  }
  write_text(path, text);
}

}  // namespace

const Format kKalibr{
    "kalibr",    "Kalibr camchain YAML (pinhole with radtan, equidistant or no distortion; omni, eucm, ds)",
    "",          recognise_kalibr,
    read_kalibr, write_kalibr};

}  // namespace tactus::calibration
