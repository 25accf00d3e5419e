/// OpenCV's FileStorage, XML or YAML, with the node names that people use: one camera a file, or a stereo
/// pair (M1 D1 M2 D2 R T of stereo_calib; R and T may stand in extrinsics.yml beside it). World to camera.
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/calibration_files/formats.h"
#include "tactus/rig/numbered_files.h"

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
const Names kWidth{"image_width", "image_Width", "width"}, kHeight{"image_height", "image_Height", "height"};

/// The node of the given name, else the usual ones. @throws Error naming what is missing.
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

/// R and T of a stereo pair: in the file, else in the one beside it that OpenCV's program writes.
std::optional<Rigidd> stereo_pose(const DataNode& root) {
  if (root.has("R") && root.has("T")) return Rigidd{read_rotation(root.at("R")), read_vector(root.at("T"))};
  std::string beside = fs::path(root.file).filename();
  const std::size_t at = beside.find("intrinsics");
  if (at == std::string::npos) return {};
  beside.replace(at, 10, "extrinsics");
  const std::string file = fs::path(root.file).parent_path() / beside;
  if (!is_file(file)) return {};
  const DataNode other = parse_yaml_data(read_file(file, kMaxCalibrationBytes, ReadFrom::regular_file), file);
  return Rigidd{read_rotation(other.at("R")), read_vector(other.at("T"))};
}

std::vector<FileCamera> read_pair(const DataNode& root, const CalibrationAnswers& answers) {
  std::optional<Rigidd> pose = stereo_pose(root);
  std::vector<FileCamera> cameras;
  for (const std::string number : {"1", "2"}) {
    FileCamera c;
    c.calibrated.camera.name = "cam" + number;
    c.has_pose = pose.has_value();
    read_camera(root.at("M" + number), root.find("D" + number), root, answers, c);
    cameras.push_back(c);
  }
  if (pose) {
    pose->t *= asked_unit_m(root.file, "OpenCV", answers);
    cameras[1].calibrated.camera.T_cam_world = *pose;
  }
  return cameras;
}

const DataNode& tree_of(const Input& input) {
  const DataNode* root = input.tree();
  if (root == nullptr) throw Error(input.path + ": not an OpenCV XML or YAML file");
  const DataNode* storage = root->find("opencv_storage");
  return storage != nullptr ? *storage : *root;
}

bool recognise(const Input& input) {
  if (!input.xml && !input.yaml && !input.json) return false;
  const DataNode& root = tree_of(input);
  if (input.xml && input.xml->has("opencv_storage")) return true;
  if (input.text.starts_with("%YAML")) return true;
  return root.find_any(kIntrinsics) != nullptr || root.has("M1");
}

std::vector<FileCamera> read(const Input& input, const CalibrationAnswers& answers) {
  const DataNode& root = tree_of(input);
  if (root.has("M1") && root.has("M2")) return read_pair(root, answers);
  return {read_one(root, answers)};
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

/// One camera: the file itself; several: a folder with one file each, named like the cameras.
void write(const std::string& path, std::span<const FileCamera> cameras) {
  if (cameras.size() == 1 && fs::path(path).has_extension()) return write_text(path, opencv_text(cameras[0]));
  make_folder(path);
  for (const FileCamera& c : cameras)
    write_text(path + "/" + c.calibrated.camera.name + ".yaml", opencv_text(c));
}

}  // namespace

const Format kOpenCv{
    "opencv",
    "OpenCV XML or YAML: one camera (camera matrix, distortion, R, T under the usual names) or a stereo "
    "pair M1 D1 M2 D2 R T",
    "unit, image size where it is not written",
    recognise,
    read,
    write};

}  // namespace tactus::calibration
