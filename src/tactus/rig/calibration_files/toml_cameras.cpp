#include "tactus/rig/calibration_files/toml_cameras.h"

#include "tactus/base/error.h"

namespace tactus::calibration {

std::vector<const DataNode*> camera_tables(const DataNode& root) {
  std::vector<const DataNode*> tables;
  const DataNode* inner = root.find("cameras");
  for (const DataNode* list : {&root, inner}) {
    if (list == nullptr) continue;
    for (const DataNode& table : list->children) {
      if (table.is_map() && &table != inner && (table.has("matrix") || table.has("translation")))
        tables.push_back(&table);
    }
  }
  return tables;
}

FileCamera read_camera_table(const DataNode& table, const char* format, double unit_m,
                             const CalibrationAnswers& answers) {
  FileCamera c;
  Camera& camera = c.calibrated.camera;
  const DataNode* name = table.find("name");
  camera.name = name != nullptr ? name->text : table.key;
  const std::vector<double> size = table.at("size").numbers(2);
  set_size(camera, image_size(table.file, format,
                              Vec2i{static_cast<Index>(size[0]), static_cast<Index>(size[1])}, answers));
  set_intrinsics(camera, table.at("matrix").matrix3(), table.at("matrix"));
  const DataNode* fisheye = table.find("fisheye");
  c.calibrated.lens =
      read_lens(fisheye != nullptr && fisheye->boolean() ? LensModel::fisheye : LensModel::brown,
                table.at("distortions"));
  camera.T_cam_world = {read_rotation(table.at("rotation")), unit_m * read_vector(table.at("translation"))};
  return c;
}

}  // namespace tactus::calibration
