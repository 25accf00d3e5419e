/// EasyMocap: intri.yml (names; K_n, dist_n) and extri.yml (R_n as a vector, Rot_n, T_n) in one folder. World
/// to camera.
#include <algorithm>
#include <filesystem>
#include <set>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/calibration_files/formats.h"
#include "tactus/rig/images/numbered_files.h"

namespace tactus::calibration {
namespace {

namespace fs = std::filesystem;

std::string folder_of(const Input& input) {
  return input.is_folder ? input.path : fs::path(input.path).parent_path().string();
}
std::string in(const std::string& folder, const char* name) { return (fs::path(folder) / name).string(); }

bool recognise_easymocap(const Input& input) {
  if (input.is_folder) return is_file(in(input.path, "intri.yml"));
  if (!input.yaml || !input.yaml->has("names")) return false;
  const DataNode& names = input.yaml->at("names");
  return !names.children.empty() &&
         (input.yaml->has("K_" + names.children[0].text) || input.yaml->has("T_" + names.children[0].text));
}

DataNode load_opencv(const std::string& file) {
  return parse_yaml_data(read_text(file, kMaxCalibrationBytes, ReadFrom::regular_file), file);
}

std::vector<FileCamera> read_easymocap(const Input& input, const CalibrationAnswers& answers) {
  const std::string folder = folder_of(input);
  const DataNode intri = load_opencv(in(folder, "intri.yml")), extri = load_opencv(in(folder, "extri.yml"));
  const double unit_m = asked_unit_m(input.path, "EasyMocap", answers);
  std::set<std::string> placed;
  if (const DataNode* names = extri.find("names")) {
    for (const DataNode& entry : names->children) placed.insert(entry.text);
  }
  std::vector<FileCamera> cameras;
  for (const DataNode& entry : intri.at("names").children) {
    const std::string name = entry.text;
    FileCamera c;
    Camera& camera = c.calibrated.camera;
    camera.name = name;
    std::optional<Vec2i> own;
    if (intri.has("W_" + name) && intri.has("H_" + name))
      own = Vec2i{intri.at("W_" + name).integer(1, 1 << 20), intri.at("H_" + name).integer(1, 1 << 20)};
    set_size(camera, image_size(intri.file, "EasyMocap", own, answers));
    set_intrinsics(camera, intri.at("K_" + name).matrix3(), intri.at("K_" + name));
    if (const DataNode* d = intri.find_any({"dist_" + name, "D_" + name}))
      c.calibrated.lens = read_unnamed_lens(*d, answers);
    // There may be lenses of cameras that were not placed.
    c.has_pose = placed.contains(name) || extri.has("T_" + name);
    if (c.has_pose) {
      camera.T_cam_world.R = read_rotation(extri.at_any({"Rot_" + name, "R_" + name}));
      camera.T_cam_world.t = unit_m * read_vector(extri.at("T_" + name));
    }
    cameras.push_back(std::move(c));
  }
  if (std::ranges::none_of(cameras, &FileCamera::has_pose))
    throw Error(extri.file + ": no pose of a camera of intri.yml, expected Rot_NAME or R_NAME, and T_NAME");
  return cameras;
}

}  // namespace

const Format kEasyMocap{"easymocap",
                        "EasyMocap: intri.yml and extri.yml in a folder",
                        "unit, image size where it is not written",
                        recognise_easymocap,
                        read_easymocap,
                        nullptr};

}  // namespace tactus::calibration
