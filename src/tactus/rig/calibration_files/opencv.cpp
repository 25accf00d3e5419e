/// OpenCV's FileStorage, XML or YAML, with the node names that people use: one camera a file, or a stereo
/// pair (M1 D1 M2 D2 R T of stereo_calib, or K1 D1 K2 D2 R T; R and T may stand in extrinsics.yml beside it).
/// World to camera.
#include <filesystem>
#include <set>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/calibration_files/formats.h"
#include "tactus/rig/images/numbered_files.h"

namespace tactus::calibration {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

const Names kIntrinsics{"CameraMatrix",
                        "camera_matrix",
                        "cameraMatrix",
                        "Camera_Matrix",
                        "mtx",
                        "K",
                        "intrinsic",
                        "intrinsics",
                        "intrinsic_matrix",
                        "M"};
const Names kDistortion{"DistortionCoeffs",
                        "distortion_coefficients",
                        "Distortion_Coefficients",
                        "distCoeffs",
                        "dist_coeffs",
                        "dist",
                        "distortion",
                        "D"};
const Names kRotation{"RotationValues", "R", "Rot", "rotation", "rotation_matrix", "rvec", "rotation_vector"};
const Names kTranslation{"TranslationValues", "T", "t", "translation", "translation_vector", "tvec"};
const Names kRigid{"Rt", "RT", "extrinsic", "extrinsics", "extrinsic_matrix"};
/// Names in a stereo pair, with 1 or 2 behind them.
const Names kPairIntrinsics{"M", "K", "cameraMatrix", "camera_matrix", "CameraMatrix", "camera_matrix_"};
const Names kPairDistortion{"D", "distCoeffs", "dist_coeffs", "distortion", "dist", "dist_coeffs_"};
const Names kWidth{"image_width", "image_Width", "width"}, kHeight{"image_height", "image_Height", "height"};

/// The node of the given name, else the usual ones. @throws Error naming the missing node.
const DataNode& node(const DataNode& root, const std::string& asked, const Names& usual) {
  return asked.empty() ? root.at_any(usual) : root.at(asked);
}

std::optional<Vec2i> own_size(const DataNode& root) {
  const DataNode *w = root.find_any(kWidth), *h = root.find_any(kHeight);
  if (const DataNode* both = root.find("image_size"); both != nullptr && w == nullptr) {
    const std::vector<double> size = both->numbers(2);
    return Vec2i{static_cast<Index>(size[0]), static_cast<Index>(size[1])};
  }
  if (w == nullptr || h == nullptr) return {};
  return Vec2i{w->integer(1, 1 << 20), h->integer(1, 1 << 20)};
}

/// The rest of a calibrated camera after its pose.
void read_camera(const DataNode& K, const DataNode* d, const DataNode& root,
                 const CalibrationAnswers& answers, FileCamera& c) {
  Camera& camera = c.calibrated.camera;
  set_size(camera, image_size(root.file, "OpenCV", own_size(root), answers));
  if (const auto v = K.numbers(); v.size() != 9) {
    const bool has_shape = K.has("rows") && K.has("cols");
    K.fail("is " +
           (has_shape ? K.at("rows").text + "x" + K.at("cols").text : std::to_string(v.size()) + " numbers") +
           ", expected 3x3");
  }
  set_intrinsics(camera, K.matrix3(), K);
  if (d == nullptr) return;
  CalibrationAnswers lens = answers;
  // OpenCV's own calibration program says so.
  if (const DataNode* fisheye = root.find("fisheye_model"); fisheye != nullptr && fisheye->boolean())
    lens.lens = LensModel::fisheye;
  c.calibrated.lens = read_unnamed_lens(*d, lens);
}

bool has_pose(const DataNode& root, const CalibrationNodes& nodes) {
  return !nodes.rotation.empty() || !nodes.translation.empty() || root.find_any(kRigid) != nullptr ||
         root.find_any(kRotation) != nullptr || root.find_any(kTranslation) != nullptr;
}

FileCamera read_one(const DataNode& root, const CalibrationAnswers& answers) {
  const CalibrationNodes& nodes = answers.nodes;
  FileCamera c;
  c.calibrated.camera.name = fs::path(root.file).stem();
  const DataNode* d = nodes.distortion.empty() ? root.find_any(kDistortion) : &root.at(nodes.distortion);
  read_camera(node(root, nodes.intrinsics, kIntrinsics), d, root, answers, c);
  c.has_pose = has_pose(root, nodes);
  if (!c.has_pose) return c;
  Rigidd& T = c.calibrated.camera.T_cam_world;
  const DataNode* rigid = nodes.rotation.empty() ? root.find_any(kRigid) : nullptr;
  if (rigid != nullptr) {
    T = read_rigid(*rigid);
  } else {
    T = {read_rotation(node(root, nodes.rotation, kRotation)),
         read_vector(node(root, nodes.translation, kTranslation))};
  }
  T.t *= asked_unit_m(root.file, "OpenCV", answers);
  return c;
}

Names numbered(const Names& names, const char* number) {
  Names result;
  for (const std::string& name : names) result.push_back(name + number);
  return result;
}

/// intrinsics.yml for extrinsics.yml and back, as OpenCV's program writes them side by side.
std::optional<DataNode> beside(const DataNode& root, const char* own, const char* other) {
  std::string name = fs::path(root.file).filename();
  const std::size_t at = name.find(own);
  if (at == std::string::npos) return {};
  name.replace(at, std::string_view(own).size(), other);
  const std::string file = fs::path(root.file).parent_path() / name;
  if (!is_file(file)) return {};
  return parse_yaml_data(read_text(file, kMaxCalibrationBytes, ReadFrom::regular_file), file);
}

bool is_pair(const DataNode& root) {
  return root.find_any(numbered(kPairIntrinsics, "1")) != nullptr &&
         root.find_any(numbered(kPairIntrinsics, "2")) != nullptr;
}

std::optional<Rigidd> stereo_pose(const DataNode& root) {
  if (!root.has("R") || !root.has("T")) return {};
  return Rigidd{read_rotation(root.at("R")), read_vector(root.at("T"))};
}

std::vector<FileCamera> read_pair(const DataNode& root, std::optional<Rigidd> pose,
                                  const CalibrationAnswers& answers) {
  std::vector<FileCamera> cameras;
  for (const char* number : {"1", "2"}) {
    FileCamera c;
    c.calibrated.camera.name = std::string("cam") + number;
    c.has_pose = pose.has_value();
    read_camera(root.at_any(numbered(kPairIntrinsics, number)),
                root.find_any(numbered(kPairDistortion, number)), root, answers, c);
    cameras.push_back(c);
  }
  if (pose) {
    pose->t *= asked_unit_m(root.file, "OpenCV", answers);
    cameras[1].calibrated.camera.T_cam_world = *pose;
  }
  return cameras;
}

/// R and T of a pair stand in the file, or in the one beside it.
std::vector<FileCamera> read_either(const DataNode& root, const CalibrationAnswers& answers) {
  if (is_pair(root)) {
    if (const auto pose = stereo_pose(root)) return read_pair(root, pose, answers);
    const std::optional<DataNode> other = beside(root, "intrinsics", "extrinsics");
    return read_pair(root, other ? stereo_pose(*other) : std::nullopt, answers);
  }
  if (root.find_any(kIntrinsics) == nullptr && root.has("R") && root.has("T")) {
    const std::optional<DataNode> other = beside(root, "extrinsics", "intrinsics");
    if (other && is_pair(*other)) return read_pair(*other, stereo_pose(root), answers);
  }
  return {read_one(root, answers)};
}

const DataNode& tree_of(const Input& input) {
  const DataNode* root = input.tree();
  if (root == nullptr) throw Error(input.path + ": not an OpenCV XML or YAML file");
  const DataNode* storage = root->find("opencv_storage");
  return storage != nullptr ? *storage : *root;
}

bool recognise_opencv(const Input& input) {
  if (!input.xml && !input.yaml && !input.json) return false;
  const DataNode& root = tree_of(input);
  if (input.xml && input.xml->has("opencv_storage")) return true;
  if (input.text.starts_with("%YAML")) return true;
  return root.find_any(kIntrinsics) != nullptr || is_pair(root);
}

std::vector<FileCamera> read_opencv(const Input& input, const CalibrationAnswers& answers) {
  return read_either(tree_of(input), answers);
}

std::string matrix(const char* name, int rows, int columns, std::span<const double> values) {
  return std::string(name) + ": !!opencv-matrix\n   rows: " + std::to_string(rows) +
         "\n   cols: " + std::to_string(columns) + "\n   dt: d\n   data: " + exact_list(values) + "\n";
}

}  // namespace

std::string opencv_text(const FileCamera& c) {
  const Camera& camera = c.calibrated.camera;
  std::string text = "%YAML:1.0\n---\nimage_width: " + std::to_string(camera.width_px) +
                     "\nimage_height: " + std::to_string(camera.height_px) + "\n";
  if (c.calibrated.lens.model == LensModel::fisheye) text += "fisheye_model: 1\n";
  std::vector<double> d = coefficients(c.calibrated.lens);
  if (d.empty()) d.resize(5);
  text += matrix("CameraMatrix", 3, 3, row_major(camera.intrinsics())) +
          matrix("DistortionCoeffs", static_cast<int>(d.size()), 1, d);
  if (!c.has_pose) return text;
  const Vec3d t = camera.T_cam_world.t;
  return text + matrix("RotationValues", 3, 3, row_major(camera.T_cam_world.R)) +
         matrix("TranslationValues", 3, 1, std::vector{t.x, t.y, t.z});
}

namespace {

/// Names of other tools hold folders ("images/left"); a file of its own has none.
std::string file_name(const std::string& camera) {
  std::string name = camera;
  for (char& c : name) c = c == '/' || c == '\\' ? '_' : c;
  return name + ".yaml";
}

/// One camera: the file itself; several: a folder with one file each, named like the cameras.
void write_opencv(const std::string& path, std::span<const FileCamera> cameras) {
  refuse_sphere_lens("OpenCV", cameras);
  if (cameras.size() == 1 && fs::path(path).has_extension()) return write_text(path, opencv_text(cameras[0]));
  make_folder(path);
  std::set<std::string> names;
  for (const FileCamera& c : cameras) {
    const std::string name = file_name(c.calibrated.camera.name);
    if (!names.insert(name).second)
      throw usage_error("camera '" + c.calibrated.camera.name + "': another one is written to " + name +
                        " already; write a format that keeps all cameras in one file, such as multical");
    write_text(path + "/" + name, opencv_text(c));
  }
}

}  // namespace

const Format kOpenCv{
    "opencv",
    "OpenCV XML or YAML: one camera (camera matrix, distortion, R, T under the usual names) or a stereo "
    "pair (M1 D1 M2 D2 R T or K1 D1 K2 D2 R T)",
    "unit, image size where it is not written",
    recognise_opencv,
    read_opencv,
    write_opencv};

}  // namespace tactus::calibration
