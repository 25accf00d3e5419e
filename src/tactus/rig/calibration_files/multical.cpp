/// multical's calibration.json: cameras {K, dist, image_size, model}, camera_poses {R, T} under `cam`
/// (reference to camera) or `a_to_b` (b's points to a's, a chain that ends at the reference camera). Unit:
/// that of the board.
#include <map>
#include <nlohmann/json.hpp>

#include "tactus/base/error.h"
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool recognise_multical(const Input& input) {
  return input.json && input.json->has("camera_poses") && input.json->has("cameras");
}

/// Reference to camera, following a_to_b. @throws Error at the poses when there is no way to the reference.
Rigidd pose_of(const DataNode& poses, const std::string& name, int depth = 0) {
  if (const DataNode* own = poses.find(name)) return {read_rotation(own->at("R")), read_vector(own->at("T"))};
  const std::string begin = name + "_to_";
  for (const DataNode& step : poses.children) {
    if (!step.key.starts_with(begin)) continue;
    if (depth > 100) step.fail("goes round in a circle");
    return Rigidd{read_rotation(step.at("R")), read_vector(step.at("T"))} *
           pose_of(poses, step.key.substr(begin.size()), depth + 1);
  }
  poses.fail("no pose of camera '" + name + "', expected '" + name + "' or '" + begin + "...'");
}

std::vector<FileCamera> read_multical(const Input& input, const CalibrationAnswers& answers) {
  const DataNode& poses = input.json->at("camera_poses");
  const double unit_m = asked_unit_m(input.path, "multical", answers);
  std::vector<FileCamera> cameras;
  for (const DataNode& from : input.json->at("cameras").children) {
    FileCamera c;
    Camera& camera = c.calibrated.camera;
    camera.name = from.key;
    const std::vector<double> size = from.at("image_size").numbers(2);
    set_size(camera, image_size(input.path, "multical",
                                Vec2i{static_cast<Index>(size[0]), static_cast<Index>(size[1])}, answers));
    set_intrinsics(camera, from.at("K").matrix3(), from.at("K"));
    const DataNode* model = from.find("model");
    const bool fisheye = model != nullptr && model->text.find("fisheye") != std::string::npos;
    c.calibrated.lens = read_lens(fisheye ? LensModel::fisheye : LensModel::brown, from.at("dist"));
    camera.T_cam_world = pose_of(poses, from.key);
    camera.T_cam_world.t *= unit_m;
    cameras.push_back(std::move(c));
  }
  return cameras;
}

nlohmann::json rows(const Mat3d& M) {
  nlohmann::json out = nlohmann::json::array();
  for (const Vec3d& r : M.row) out.push_back({r.x, r.y, r.z});
  return out;
}

void write_multical(const std::string& path, std::span<const FileCamera> cameras) {
  refuse_sphere_lens("multical", cameras);
  nlohmann::json json;
  for (const FileCamera& file : cameras) {
    const Camera& c = file.calibrated.camera;
    const Lens& lens = file.calibrated.lens;
    std::vector<double> d = coefficients(lens);
    d.resize(std::max<std::size_t>(d.size(), lens.model == LensModel::fisheye ? 4 : 5));
    const char* models[] = {"standard", "rational", "thin_prism", "tilted"};
    const int kind = d.size() <= 5 ? 0 : (d.size() <= 8 ? 1 : (d.size() <= 12 ? 2 : 3));
    json["cameras"][c.name] = {{"model", lens.model == LensModel::fisheye ? "fisheye" : models[kind]},
                               {"image_size", {c.width_px, c.height_px}},
                               {"K", rows(c.intrinsics())},
                               {"dist", nlohmann::json::array({d})}};
    const Vec3d t = c.T_cam_world.t;
    json["camera_poses"][c.name] = {{"R", rows(c.T_cam_world.R)}, {"T", {t.x, t.y, t.z}}};
  }
  write_text(path, json.dump(2) + "\n");
}

}  // namespace

const Format kMultical{"multical",    "multical calibration.json", "unit", recognise_multical, read_multical,
                       write_multical};

}  // namespace tactus::calibration
