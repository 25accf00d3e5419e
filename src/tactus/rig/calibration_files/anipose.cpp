/// calibration.toml of anipose (aniposelib), FreeMoCap and Pose2Sim, which look the same; the first two are
/// in the unit of the board, the last in metres, and nothing in the file tells which.
#include "tactus/base/error.h"
#include "tactus/geom/maths/rotation.h"
#include "tactus/rig/calibration_files/toml_cameras.h"

namespace tactus::calibration {
namespace {

bool recognise_anipose(const Input& input) { return input.toml && !camera_tables(*input.toml).empty(); }

std::vector<FileCamera> read_anipose(const Input& input, const CalibrationAnswers& answers) {
  const double unit_m = asked_unit_m(input.path, "anipose, FreeMoCap and Pose2Sim", answers);
  std::vector<FileCamera> cameras;
  if (!input.toml) throw Error(input.path + ": no TOML");
  for (const DataNode* table : camera_tables(*input.toml))
    cameras.push_back(read_camera_table(*table, "anipose, FreeMoCap and Pose2Sim", unit_m, answers));
  return cameras;
}

void write_anipose(const std::string& path, std::span<const FileCamera> cameras) {
  refuse_sphere_lens("Pose2Sim", cameras);
  std::string text;
  for (const FileCamera& file : cameras) {
    const Camera& c = file.calibrated.camera;
    const bool fisheye = file.calibrated.lens.model == LensModel::fisheye;
    std::vector<double> d = coefficients(file.calibrated.lens);
    if (d.empty()) d.resize(4);
    const Vec3d r = vector_of_rotation(c.T_cam_world.R), t = c.T_cam_world.t;
    text += "[\"" + c.name + "\"]\nname = \"" + c.name + "\"\nsize = " +
            exact_list(std::vector{static_cast<double>(c.width_px), static_cast<double>(c.height_px)}) +
            "\nmatrix = [";
    for (int i = 0; i < 3; ++i) {
      const Vec3d row = c.intrinsics().row[i];
      text += (i == 0 ? "" : ", ") + exact_list(std::vector{row.x, row.y, row.z});
    }
    text += "]\ndistortions = " + exact_list(d) + "\nrotation = " + exact_list(std::vector{r.x, r.y, r.z}) +
            "\ntranslation = " + exact_list(std::vector{t.x, t.y, t.z}) +
            "\nfisheye = " + (fisheye ? "true" : "false") + "\n\n";
  }
  write_text(path, text + "[metadata]\nadjusted = false\nerror = 0.0\n");
}

}  // namespace

const Format kAnipose{"pose2sim",   "TOML of anipose, FreeMoCap and Pose2Sim (written for Pose2Sim: metres)",
                      "unit",       recognise_anipose,
                      read_anipose, write_anipose};

}  // namespace tactus::calibration
