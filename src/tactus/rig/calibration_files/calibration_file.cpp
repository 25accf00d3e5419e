#include "tactus/rig/calibration_files/calibration_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/base/read_file.h"
#include "tactus/media/film_reader.h"
#include "tactus/rig/calibrate/board.h"
#include "tactus/rig/calibrate/bundle.h"
#include "tactus/rig/calibration_files/formats.h"
#include "tactus/rig/images/numbered_files.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;
using calibration::Format;
using calibration::Input;

/// In the order in which content is checked: formats that are recognised with certainty come first.
const Format* const kFormats[] = {
    &calibration::kColmapBinary, &calibration::kColmapText, &calibration::kQualisys,
    &calibration::kVicon,        &calibration::kSplatting,  &calibration::kAzureKinect,
    &calibration::kNerfstudio,   &calibration::kMultical,   &calibration::kMatlab,
    &calibration::kCaliscope,    &calibration::kAnipose,    &calibration::kKalibr,
    &calibration::kMcCalib,      &calibration::kEasyMocap,  &calibration::kRosCameraInfo,
    &calibration::kOpenCv,       &calibration::kMiddlebury, &calibration::kProjections,
};

/// "[x]" alone on a line, or "key = value".
bool looks_like_toml(const std::string& text) {
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::size_t first = text.find_first_not_of(" \t\r", begin);
    if (first < end && text[first] != '#') {
      const std::string line = text.substr(first, end - first);
      if (line[0] == '[') return line.find(']') != std::string::npos && line.find(',') == std::string::npos;
      const std::size_t equals = line.find('='), colon = line.find(':');
      return equals != std::string::npos && (colon == std::string::npos || equals < colon);
    }
    begin = end + 1;
  }
  return false;
}

/// "{" or "[{", with any space between; TOML begins lists of tables with "[[".
bool is_json(std::string_view start) {
  if (start[0] == '{') return true;
  const std::size_t second = start.find_first_not_of(" \t\r\n", 1);
  return start[0] == '[' && second != start.npos && (start[second] == '{' || start[1] == '\n');
}

/// Two or more words on the first line, all numbers but perhaps the first: no YAML that anybody writes.
bool looks_like_table(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  return begin != std::string::npos && text.find(':') == std::string::npos &&
         text.find('{') == std::string::npos;
}

Input load(const std::string& path) {
  Input input;
  input.path = path;
  if (!is_there(path)) throw Error(path + ": no such calibration" + suggest_file(path));
  std::error_code failed;
  input.is_folder = fs::is_directory(path, failed);
  if (input.is_folder) return input;
  input.text = read_text(path, kMaxCalibrationBytes, ReadFrom::regular_file);
  while (!input.text.empty() && input.text.back() == '\0')
    input.text.pop_back();  // Azure Kinect ends with one
  const std::size_t first = input.text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) throw Error(path + ": the file is empty");
  if (input.text.find('\0') != std::string::npos) return input;  // binary
  const std::string_view start = std::string_view(input.text).substr(first);
  if (start[0] == '<') {
    input.xml = parse_xml_data(input.text, path);
  } else if (is_json(start)) {
    input.json = parse_json_data(input.text, path);
  } else if (looks_like_toml(input.text)) {
    input.toml = parse_toml_data(input.text, path);
  } else if (!looks_like_table(input.text)) {
    input.yaml = parse_yaml_data(input.text, path);
  }
  return input;
}

/// A matrix with |R R^T - I| below kRounded is a rounded rotation, from kTold on with a warning; one that is
/// further off is no rotation.
constexpr double kRounded = 1e-2, kTold = 1e-3;

/// The rotation that is nearest to a rounded one, by Newton's iteration of the polar decomposition, which
/// squares the error. A matrix that is no rotation stays, and is refused later.
void make_rotation(const std::string& path, Camera& camera, bool has_centers) {
  Rigidd& T = camera.T_cam_world;
  const Mat3d off = T.R * transpose(T.R) - Mat3d::identity();
  double worst = 0;
  for (const Vec3d& row : off.row)
    worst = std::max(worst, std::abs(row.x) + std::abs(row.y) + std::abs(row.z));
  if (!(worst < kRounded) || !(determinant(T.R) > 0) || worst < 1e-9) return;
  const Vec3d center = -(inverse(T.R) * T.t);
  for (int i = 0; i < 5; ++i) T.R = 0.5 * (T.R - (-1.0) * transpose(inverse(T.R)));
  if (has_centers) T.t = -(T.R * center);
  if (worst >= kTold)
    log_warning(path + ": camera '" + camera.name + "': its rotation has few digits (|R R^T - I| = " +
                number_text(worst) + "); the nearest rotation is taken");
}

std::vector<std::string> format_names() {
  std::vector<std::string> names;
  for (const Format* f : kFormats) names.emplace_back(f->name);
  return names;
}

const Format& find_format(const std::string& name, const std::string& asker) {
  for (const Format* f : kFormats) {
    if (name == f->name) return *f;
  }
  throw usage_error(asker + " '" + name + "' is no format of calibrations" +
                    suggestion(name, format_names()));
}

const Format& recognise(const Input& input, const CalibrationAnswers& answers) {
  if (!answers.format.empty()) return find_format(answers.format, answers.format_name);
  for (const Format* f : kFormats) {
    if (f->recognise(input)) return *f;
  }
  std::string names;
  for (const std::string& name : format_names()) names += (names.empty() ? "" : ", ") + name;
  std::string keys;
  if (const DataNode* tree = input.tree(); tree != nullptr && tree->is_map()) {
    for (std::size_t i = 0; i < std::min<std::size_t>(8, tree->children.size()); ++i)
      keys += (keys.empty() ? "; its keys are " : ", ") + excerpt(tree->children[i].key);
  }
  throw Error(input.path + ": no calibration of a known format (" + names + ")" + keys);
}

}  // namespace

CalibrationData read_calibration_file(const std::string& path, const CalibrationAnswers& answers) {
  const Input input = load(path);
  const Format& format = recognise(input, answers);
  CalibrationData data{format.name, format.read(input, answers)};
  if (data.cameras.empty()) throw Error(path + ": no camera in this " + format.name + " calibration");
  if (data.cameras.size() > 10000)
    throw Error(path + ": " + std::to_string(data.cameras.size()) + " cameras, expected at most 10000");
  std::set<std::string> names;
  for (FileCamera& c : data.cameras) {
    Camera& camera = c.calibrated.camera;
    if (!names.insert(camera.name).second)
      throw Error(path + ": camera '" + camera.name + "' stands there twice");
    make_rotation(path, camera, format.has_centers);
    try {
      check_camera(camera);
    } catch (const Error& e) {
      throw Error(path + ": " + e.what());
    }
  }
  return data;
}

const FileCamera& camera_of(const CalibrationData& data, const std::string& name, const std::string& path) {
  const FileCamera* found = data.cameras.size() == 1 ? data.cameras.data() : nullptr;
  std::vector<std::string> names;
  for (const FileCamera& c : data.cameras) {
    names.push_back(c.calibrated.camera.name);
    if (names.back() == name) found = &c;
  }
  if (found == nullptr) throw Error(path + ": no camera '" + name + "'" + suggestion(name, names));
  if (!found->has_pose) {
    throw Error(path + ": this " + data.format + " calibration is a lens alone, camera '" +
                found->calibrated.camera.name + "' has no pose");
  }
  return *found;
}

void check_written_format(const std::string& format) {
  if (find_format(format, "--to").write != nullptr) return;
  std::string written;
  for (const Format* f : kFormats) {
    if (f->write != nullptr) written += (written.empty() ? "" : ", ") + std::string(f->name);
  }
  throw usage_error("--to '" + format + "' is only read; written are: " + written);
}

void write_calibration_file(const std::string& path, const std::string& format,
                            std::span<const FileCamera> cameras) {
  check_written_format(format);
  for (const FileCamera& c : cameras) {
    if (!c.has_pose && format != "opencv")
      throw usage_error("camera '" + c.calibrated.camera.name +
                        "' has no pose: only opencv files hold a lens alone");
  }
  find_format(format, "--to").write(path, cameras);
}

std::vector<std::string> missing_parts() {
  std::vector<std::string> parts;
  for (const std::string& part :
       {toml_missing(), calibration_missing(), boards_missing(), charuco_missing(), films_missing()}) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

std::vector<CalibrationFormatInfo> calibration_formats() {
  std::vector<CalibrationFormatInfo> list;
  for (const Format* f : kFormats) list.push_back({f->name, f->of, f->write != nullptr, f->asks});
  std::sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return list;
}

}  // namespace tactus
