/// caliscope: camera_array.toml ([cameras.0]) and the config.toml before it ([cam_0]). Metres.
#include "tactus/base/error.h"
#include "tactus/rig/calibration_files/toml_cameras.h"

namespace tactus::calibration {
namespace {

/// It alone writes rotation_count. A camera that was never posed has no translation.
bool is_of_caliscope(const DataNode& table) { return table.has("rotation_count"); }

bool recognise_caliscope(const Input& input) {
  if (!input.toml) return false;
  for (const DataNode* table : camera_tables(*input.toml)) {
    if (is_of_caliscope(*table)) return true;
  }
  return false;
}

std::vector<FileCamera> read_caliscope(const Input& input, const CalibrationAnswers& answers) {
  const double unit_m = known_unit_m(input.path, "caliscope", 1, answers);
  std::vector<FileCamera> cameras;
  for (const DataNode* table : camera_tables(*input.toml)) {
    if (const DataNode* ignored = table->find("ignore"); ignored != nullptr && ignored->boolean()) continue;
    FileCamera c = read_camera_table(*table, "caliscope", unit_m, answers);
    // Both layouts name a camera by its number.
    if (table->has("cam_id") || table->has("port"))
      c.calibrated.camera.name = table->at_any({"cam_id", "port"}).text;
    cameras.push_back(std::move(c));
  }
  return cameras;
}

}  // namespace

const Format kCaliscope{
    "caliscope", "caliscope camera_array.toml or config.toml", "", recognise_caliscope, read_caliscope,
    nullptr};

}  // namespace tactus::calibration
