/// nerfstudio's transforms.json: camera to world, OpenGL axes, pixel centres at one half, no unit.
#include <filesystem>

#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool recognise_nerfstudio(const Input& input) { return input.json && input.json->has("frames"); }

/// A frame's own value, else the file's for all frames.
const DataNode* find(const DataNode& frame, const DataNode& root, const char* key) {
  const DataNode* own = frame.find(key);
  return own != nullptr ? own : root.find(key);
}
double number(const DataNode& frame, const DataNode& root, const char* key) {
  const DataNode* node = find(frame, root, key);
  return node != nullptr ? node->number() : root.at(key).number();
}

Lens lens_of(const DataNode& frame, const DataNode& root) {
  const auto k = [&](const char* key) {
    const DataNode* node = find(frame, root, key);
    return node != nullptr ? node->number() : 0.0;
  };
  const DataNode* model = find(frame, root, "camera_model");
  const std::string name = model != nullptr ? model->text : "OPENCV";
  if (name == "OPENCV_FISHEYE")
    return make_lens(LensModel::fisheye, std::vector{k("k1"), k("k2"), k("k3"), k("k4")});
  if (name != "OPENCV" && name != "PINHOLE" && name != "SIMPLE_PINHOLE")
    model->fail("'" + name + "', expected OPENCV, OPENCV_FISHEYE or PINHOLE");
  if (k("k4") != 0) find(frame, root, "k4")->fail("only camera_model OPENCV_FISHEYE has a k4");
  const std::vector<double> d{k("k1"), k("k2"), k("p1"), k("p2"), k("k3")};
  if (d == std::vector<double>(5)) return {};
  return make_lens(LensModel::brown, d);
}

std::vector<FileCamera> read_nerfstudio(const Input& input, const CalibrationAnswers& answers) {
  const DataNode& root = *input.json;
  const double unit_m = asked_unit_m(input.path, "nerfstudio", answers);
  std::vector<FileCamera> cameras;
  for (const DataNode& frame : root.at("frames").children) {
    FileCamera c;
    Camera& camera = c.calibrated.camera;
    camera.name = std::filesystem::path(frame.at("file_path").text).replace_extension("").string();
    const auto side = [&](const char* key) {
      const DataNode* node = find(frame, root, key);
      return (node != nullptr ? *node : root.at(key)).integer(1, 1 << 20);
    };
    set_size(camera, image_size(input.path, "nerfstudio", Vec2i{side("w"), side("h")}, answers));
    const double fx = number(frame, root, "fl_x");
    const double fy = find(frame, root, "fl_y") != nullptr ? number(frame, root, "fl_y") : fx;
    set_intrinsics(
        camera,
        {{{fx, 0, number(frame, root, "cx") - 0.5}, {0, fy, number(frame, root, "cy") - 0.5}, {0, 0, 1}}},
        frame);
    c.calibrated.lens = lens_of(frame, root);
    Rigidd T_world_glcam = read_rigid(frame.at("transform_matrix"));
    T_world_glcam.t *= unit_m;
    camera.T_cam_world = from_opengl_camera_to_world(T_world_glcam);
    cameras.push_back(std::move(c));
  }
  return cameras;
}

}  // namespace

const Format kNerfstudio{
    "nerfstudio", "nerfstudio transforms.json", "unit", recognise_nerfstudio, read_nerfstudio, nullptr, true};

}  // namespace tactus::calibration
