/// MC-Calib's calibrated_cameras_data.yml: camera_pose_matrix is camera to reference camera.
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool recognise_mc_calib(const Input& input) { return input.yaml && input.yaml->has("nb_camera"); }

std::vector<FileCamera> read_mc_calib(const Input& input, const CalibrationAnswers& answers) {
  const DataNode& root = *input.yaml;
  const double unit_m = asked_unit_m(input.path, "MC-Calib", answers);
  std::vector<FileCamera> cameras;
  const int count = root.at("nb_camera").integer(1, 10000);
  for (int i = 0; i < count; ++i) {
    const DataNode& from = root.at("camera_" + std::to_string(i));
    FileCamera c;
    Camera& camera = c.calibrated.camera;
    camera.name = from.key;
    std::optional<Vec2i> own;
    if (from.has("img_width") && from.has("img_height"))
      own = Vec2i{from.at("img_width").integer(1, 1 << 20), from.at("img_height").integer(1, 1 << 20)};
    set_size(camera, image_size(input.path, "MC-Calib", own, answers));
    set_intrinsics(camera, from.at("camera_matrix").matrix3(), from.at("camera_matrix"));
    const bool fisheye = from.at("distortion_type").integer(0, 1) == 1;
    c.calibrated.lens =
        read_lens(fisheye ? LensModel::fisheye : LensModel::brown, from.at("distortion_vector"));
    camera.T_cam_world = inverse_pose(read_rigid(from.at("camera_pose_matrix")));
    camera.T_cam_world.t *= unit_m;
    cameras.push_back(std::move(c));
  }
  return cameras;
}

}  // namespace

const Format kMcCalib{
    "mc-calib", "MC-Calib calibrated_cameras_data.yml", "unit", recognise_mc_calib, read_mc_calib, nullptr,
    true};

}  // namespace tactus::calibration
