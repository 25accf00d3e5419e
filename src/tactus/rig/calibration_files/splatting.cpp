/// cameras.json of 3D Gaussian splatting (Kerbl et al. 2023): a list of img_name, width, height, fx, fy,
/// position (the centre) and rotation (camera to world, rows), axes as ours. No unit, no lens; the principal
/// point is the picture's middle.
#include <filesystem>

#include "tactus/base/error.h"
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool recognise_splatting(const Input& input) {
  if (!input.json || input.json->children.empty()) return false;
  const DataNode& first = input.json->children[0];
  return first.is_map() && first.has("position") && first.has("rotation") && first.has("fx");
}

std::vector<FileCamera> read_splatting(const Input& input, const CalibrationAnswers& answers) {
  if (!input.json) throw Error(input.path + ": no JSON");
  const double unit_m = asked_unit_m(input.path, "3D Gaussian splatting", answers);
  std::vector<FileCamera> cameras;
  for (const DataNode& from : input.json->children) {
    FileCamera c;
    Camera& camera = c.calibrated.camera;
    camera.name = std::filesystem::path(from.at_any({"img_name", "id"}).text).replace_extension("").string();
    const Vec2i size{from.at("width").integer(1, 1 << 20), from.at("height").integer(1, 1 << 20)};
    set_size(camera, image_size(input.path, "3D Gaussian splatting", size, answers));
    set_intrinsics(camera,
                   {{{from.at("fx").number(), 0, 0.5 * (size.x - 1)},
                     {0, from.at("fy").number(), 0.5 * (size.y - 1)},
                     {0, 0, 1}}},
                   from);
    camera.T_cam_world =
        inverse_pose({from.at("rotation").matrix3(), unit_m * read_vector(from.at("position"))});
    cameras.push_back(std::move(c));
  }
  return cameras;
}

}  // namespace

const Format kSplatting{
    "3dgs", "cameras.json of 3D Gaussian splatting", "unit", recognise_splatting, read_splatting, nullptr,
    true};

}  // namespace tactus::calibration
