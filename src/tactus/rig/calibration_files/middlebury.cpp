/// Middlebury multi-view *_par.txt: a count, then per line a name, K, R and t, 21 numbers. Metres, world to
/// camera.
#include "tactus/rig/calibration_files/middlebury.h"

#include <sstream>

#include "tactus/base/error.h"
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {
namespace {

bool recognise_middlebury(const Input& input) {
  if (input.is_folder || input.tree() != nullptr) return false;
  std::istringstream in(input.text);
  std::string first, second, word;
  if (!std::getline(in, first) || !std::getline(in, second)) return false;
  if (first.find_first_not_of("0123456789 \t\r") != std::string::npos) return false;
  std::istringstream line(second);
  int words = 0;
  while (line >> word) ++words;
  return words == 22;
}

Camera parse_middlebury_line(const std::string& line, const std::string& where) {
  std::istringstream in(line);
  Camera c;
  double v[21];
  in >> c.name;
  for (double& x : v) {
    if (!(in >> x)) {
      throw Error(where + ": camera '" + c.name +
                  "': expected a name and 21 finite numbers (K, R, t), found " + std::to_string(&x - v));
    }
  }
  if (v[3] != 0 || v[6] != 0 || v[7] != 0 || v[8] != 1)
    throw Error(where + ": camera '" + c.name +
                "': K is not a camera matrix, expected [f s c; 0 f c; 0 0 1]");
  c.fx_px = v[0];
  c.skew_px = v[1];
  c.cx_px = v[2];
  c.fy_px = v[4];
  c.cy_px = v[5];
  for (int i = 0; i < 9; ++i) c.T_cam_world.R(i / 3, i % 3) = v[9 + i];
  for (int i = 0; i < 3; ++i) c.T_cam_world.t[i] = v[18 + i];
  return c;
}

std::vector<FileCamera> read_middlebury(const Input& input, const CalibrationAnswers& answers) {
  const double unit_m = known_unit_m(input.path, "Middlebury", 1, answers);
  std::vector<FileCamera> cameras;
  for (const MiddleburyCamera& from : read_middlebury_cameras(input.text, input.path)) {
    cameras.push_back({{from.camera, {}}});
    cameras.back().calibrated.camera.T_cam_world.t *= unit_m;
    set_size(cameras.back().calibrated.camera, image_size(input.path, "Middlebury", {}, answers));
  }
  return cameras;
}

}  // namespace

const Format kMiddlebury{"middlebury",    "Middlebury multi-view *_par.txt",
                         "image size",    recognise_middlebury,
                         read_middlebury, nullptr};

}  // namespace tactus::calibration

namespace tactus {

/// The file begins with the number of its lines, by which a file that was cut short is known.
std::vector<MiddleburyCamera> read_middlebury_cameras(const std::string& text, const std::string& file) {
  std::istringstream in(text);
  std::string line;
  std::getline(in, line);
  int reported = -1;
  if (std::sscanf(line.c_str(), "%d", &reported) != 1 || reported < 0)
    throw Error(file + ":1: " + excerpt(line) + ", expected the number of cameras");
  std::vector<MiddleburyCamera> cameras;
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::string where = file + ":" + std::to_string(number);
    cameras.push_back({calibration::parse_middlebury_line(line, where), where});
  }
  if (std::ssize(cameras) != reported) {
    throw Error(file + ": " + std::to_string(reported) + " cameras are announced, " +
                std::to_string(cameras.size()) + " are there; the file is cut short or damaged");
  }
  return cameras;
}

}  // namespace tactus
