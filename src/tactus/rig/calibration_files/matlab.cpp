/// MATLAB's camera parameters as jsonencode writes them: one struct, a list, or {"cameras": ...}. The first
/// pixel is (1,1); RotationMatrix and IntrinsicMatrix stand transposed (rows of points times matrix); K does
/// not.
#include "tactus/base/error.h"
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool is_of_matlab(const DataNode& node) {
  return node.has("IntrinsicMatrix") || node.has("RadialDistortion");
}

std::vector<const DataNode*> structs(const DataNode& root) {
  const DataNode* inner = root.find_any({"cameras", "Cameras"});
  const DataNode& from = inner != nullptr ? *inner : root;
  if (is_of_matlab(from)) return {&from};
  std::vector<const DataNode*> found;
  for (const DataNode& child : from.children) {
    if (is_of_matlab(child)) found.push_back(&child);
  }
  return found;
}

bool recognise_matlab(const Input& input) { return input.json && !structs(*input.json).empty(); }

double unit_m(const DataNode& from, const CalibrationAnswers& answers) {
  const DataNode* unit = from.find("WorldUnits");
  if (unit == nullptr) return asked_unit_m(from.file, "MATLAB (without WorldUnits)", answers);
  struct Known {
    const char* name;
    double m;
  };
  for (const Known& known : {Known{"millimeters", 1e-3},
                             {"mm", 1e-3},
                             {"centimeters", 1e-2},
                             {"cm", 1e-2},
                             {"meters", 1.0},
                             {"m", 1.0},
                             {"inches", 0.0254},
                             {"in", 0.0254}}) {
    if (unit->text == known.name) return known_unit_m(from.file, "these MATLAB", known.m, answers);
  }
  unit->fail("'" + unit->text + "', expected millimeters, centimeters, meters or inches");
}

FileCamera read_one(const DataNode& from, std::size_t number, const CalibrationAnswers& answers) {
  FileCamera c;
  Camera& camera = c.calibrated.camera;
  const DataNode* name = from.find_any({"name", "Name"});
  camera.name =
      name != nullptr ? name->text : (from.key.empty() ? "camera" + std::to_string(number) : from.key);
  std::optional<Vec2i> own;
  if (const DataNode* size = from.find("ImageSize"); size != nullptr) {
    const std::vector<double> v = size->numbers(2);  // rows, columns
    own = Vec2i{static_cast<Index>(v[1]), static_cast<Index>(v[0])};
  }
  set_size(camera, image_size(from.file, "MATLAB", own, answers));
  const bool modern = from.has("K");
  const DataNode& K = from.at(modern ? "K" : "IntrinsicMatrix");
  set_intrinsics(camera, modern ? K.matrix3() : transpose(K.matrix3()), K);
  camera.cx_px -= 1;
  camera.cy_px -= 1;
  const std::vector<double> radial = from.at("RadialDistortion").numbers(),
                            tangential = from.at("TangentialDistortion").numbers(2);
  if (radial.size() != 2 && radial.size() != 3)
    from.at("RadialDistortion").fail("holds " + std::to_string(radial.size()) + " numbers, expected 2 or 3");
  c.calibrated.lens = make_lens(
      LensModel::brown,
      std::vector{radial[0], radial[1], tangential[0], tangential[1], radial.size() == 3 ? radial[2] : 0.0});
  const DataNode *R = from.find("RotationMatrix"), *R_modern = from.find("R");
  c.has_pose = R != nullptr || R_modern != nullptr;
  if (!c.has_pose) return c;
  camera.T_cam_world.R = R != nullptr ? transpose(R->matrix3()) : R_modern->matrix3();
  camera.T_cam_world.t =
      unit_m(from, answers) * read_vector(from.at_any({"TranslationVector", "Translation"}));
  return c;
}

std::vector<FileCamera> read_matlab(const Input& input, const CalibrationAnswers& answers) {
  if (!input.json) throw Error(input.path + ": no JSON");
  std::vector<FileCamera> cameras;
  for (const DataNode* from : structs(*input.json))
    cameras.push_back(read_one(*from, cameras.size() + 1, answers));
  return cameras;
}

}  // namespace

const Format kMatlab{"matlab",
                     "MATLAB camera parameters as JSON (jsonencode)",
                     "unit and image size where they are not written",
                     recognise_matlab,
                     read_matlab,
                     nullptr};

}  // namespace tactus::calibration
