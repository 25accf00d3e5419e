/// Qualisys .qca.txt: XML. Lengths in millimetres, pixels in 1/64, position of the camera in the world and a
/// rotation whose rows are the camera's axes: x right, y up, z backwards. Distortion is OpenCV's and has no
/// unit: it is not divided (docs/rig.md).
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool recognise_qualisys(const Input& input) {
  return input.xml && input.xml->has("calibration") && input.xml->at("calibration").has("cameras");
}

double value(const DataNode& node, const char* key) { return node.at(key).number(); }

/// Theia writes the same XML with whole pixels, and a pose from the world to the camera: the cameras that a
/// Qualisys reader would make of it are far off. No sensor has less than 256 pixels a row.
void refuse_whole_pixels(const DataNode& from) {
  const DataNode& intrinsic = from.at("intrinsic");
  constexpr double kLeastSensor = 256 * 64;
  if (intrinsic.has("sensorMaxU") && value(intrinsic, "sensorMaxU") < kLeastSensor)
    intrinsic.fail(
        "sensorMaxU counts whole pixels, as files of Theia do, where Qualisys counts 1/64 of them; "
        "export the calibration from Qualisys Track Manager (.qca.txt)");
}

FileCamera read_one(const DataNode& from, const std::string& path, const CalibrationAnswers& answers) {
  constexpr double kPart = 1.0 / 64;
  const DataNode &view = from.at("fov_video"), &intrinsic = from.at("intrinsic"),
                 &pose = from.at("transform");
  FileCamera c;
  Camera& camera = c.calibrated.camera;
  camera.name = from.at("serial").text;
  const double left = value(view, "left"), top = value(view, "top");
  set_size(camera, image_size(path, "Qualisys",
                              Vec2i{static_cast<Index>(value(view, "right") - left + 1),
                                    static_cast<Index>(value(view, "bottom") - top + 1)},
                              answers));
  camera.fx_px = kPart * value(intrinsic, "focalLengthU");
  camera.fy_px = kPart * value(intrinsic, "focalLengthV");
  camera.cx_px = kPart * value(intrinsic, "centerPointU") - left;
  camera.cy_px = kPart * value(intrinsic, "centerPointV") - top;
  if (!(camera.fx_px > 0) || !(camera.fy_px > 0)) intrinsic.fail("focal lengths must be positive");
  std::vector<double> k;
  for (const char* key :
       {"radialDistortion1", "radialDistortion2", "tangentalDistortion1", "tangentalDistortion2"})
    k.push_back(value(intrinsic, key));
  if (intrinsic.has("radialDistortion3")) k.push_back(value(intrinsic, "radialDistortion3"));
  c.calibrated.lens = make_lens(LensModel::brown, k);
  Mat3d R_glcam_world;
  for (int i = 0; i < 9; ++i) {
    const char key[] = {'r', static_cast<char>('1' + i / 3), static_cast<char>('1' + i % 3), '\0'};
    R_glcam_world(i / 3, i % 3) = value(pose, key);
  }
  const Vec3d center_m = 1e-3 * Vec3d{value(pose, "x"), value(pose, "y"), value(pose, "z")};
  camera.T_cam_world = from_opengl_camera_to_world({inverse(R_glcam_world), center_m});
  return c;
}

std::vector<FileCamera> read_qualisys(const Input& input, const CalibrationAnswers& answers) {
  known_unit_m(input.path, "Qualisys", 1e-3, answers);
  std::vector<FileCamera> cameras;
  for (const DataNode* from : input.xml->at("calibration").at("cameras").all("camera")) {
    refuse_whole_pixels(*from);
    // Marker cameras have no picture.
    if (from->has("fov_video")) cameras.push_back(read_one(*from, input.path, answers));
  }
  return cameras;
}

}  // namespace

const Format kQualisys{
    "qualisys", "Qualisys .qca.txt (video cameras)", "", recognise_qualisys, read_qualisys, nullptr, true};

}  // namespace tactus::calibration
