/// ROS camera_info YAML: a lens alone.
#include <filesystem>

#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool recognise_ros_camera_info(const Input& input) {
  return input.yaml && input.yaml->has("camera_matrix") && input.yaml->has("distortion_model");
}

std::vector<FileCamera> read_ros_camera_info(const Input& input, const CalibrationAnswers& answers) {
  const DataNode& root = *input.yaml;
  FileCamera c;
  c.has_pose = false;
  Camera& camera = c.calibrated.camera;
  const DataNode* name = root.find("camera_name");
  camera.name = name != nullptr ? name->text : std::filesystem::path(input.path).stem().string();
  const Vec2i size{root.at("image_width").integer(1, 1 << 20), root.at("image_height").integer(1, 1 << 20)};
  set_size(camera, image_size(input.path, "ROS", size, answers));
  set_intrinsics(camera, root.at("camera_matrix").matrix3(), root.at("camera_matrix"));
  const DataNode& model = root.at("distortion_model");
  const bool brown = model.text == "plumb_bob" || model.text == "rational_polynomial";
  if (!brown && model.text != "equidistant" && model.text != "fisheye")
    model.fail("'" + model.text + "', expected plumb_bob, rational_polynomial, equidistant or fisheye");
  c.calibrated.lens =
      read_lens(brown ? LensModel::brown : LensModel::fisheye, root.at("distortion_coefficients"));
  return {c};
}

}  // namespace

const Format kRosCameraInfo{
    "ros", "ROS camera_info YAML (lens only)", "", recognise_ros_camera_info, read_ros_camera_info, nullptr};

}  // namespace tactus::calibration
