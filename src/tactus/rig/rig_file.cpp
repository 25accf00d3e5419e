#include "tactus/rig/rig_file.h"
#include "tactus/rig/live_address.h"

#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <tuple>

#include "tactus/base/error.h"
#include "tactus/base/log.h"
#include "tactus/geom/camera/place_limits.h"
#include "tactus/rig/calibration_files/calibration_file.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/rig_keys.h"
#include "tactus/rig/yaml_reader.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

/// Rotation from the calibration's world to one with +Y up.
Mat3d rotation_to_y_up(const YamlMapping& yaml) {
  const std::string up = yaml.text("up", "+y");
  if (up == "+y") return Mat3d::identity();
  if (up == "-y") return {{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  if (up == "+z") return {{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}};
  if (up == "-z") return {{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}};
  if (up == "+x") return {{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}};
  if (up == "-x") return {{{0, 1, 0}, {-1, 0, 0}, {0, 0, 1}}};
  yaml.fail("up", "'" + up + "', expected +x, -x, +y, -y, +z or -z");
}

BackgroundOptions background_options(const YamlMapping& rig) {
  BackgroundOptions o;
  if (!rig.has("background")) return o;
  const YamlMapping y = rig.child("background", rig_keys("background"));
  o.method = background_method(y.text("method", "model"));
  o.spread = y.number("spread", 0, 100, o.spread);
  o.adapt_s = y.number("adapt_s", 0, 1e6, o.adapt_s);
  o.key_degrees = y.number("key_degrees", 0, 90, o.key_degrees);
  o.least_part = y.number("least_part", 0, 1, o.least_part);
  if (y.has("key")) {
    const std::vector<double> rgb = y.numbers("key", 3);
    for (const double v : rgb) {
      if (v < 0 || v > 255) y.fail("key", "expected red, green and blue, 0 to 255 each");
    }
    o.key = {static_cast<std::uint8_t>(rgb[0]), static_cast<std::uint8_t>(rgb[1]),
             static_cast<std::uint8_t>(rgb[2])};
  }
  o.chroma = y.number("chroma", 0, 442, o.chroma);
  o.darkest_shadow = y.number("darkest_shadow", 0, 1, o.darkest_shadow);
  o.brightest = y.number("brightest", 1, 100, o.brightest);
  o.noise = y.number("noise", 0, 442, o.noise);
  o.open_px = y.integer("open_px", 0, 50, o.open_px);
  o.close_px = y.integer("close_px", 0, 50, o.close_px);
  o.largest_hole_px = y.integer("largest_hole_px", 0, 100000000, o.largest_hole_px);
  return o;
}

CalibrationNodes calibration_nodes(const YamlMapping& rig) {
  if (!rig.has("calibration_nodes")) return {};
  const YamlMapping y = rig.child("calibration_nodes", rig_keys("calibration_nodes"));
  return {y.text("intrinsics", ""), y.text("distortion", ""), y.text("rotation", ""),
          y.text("translation", "")};
}

std::optional<LensModel> lens_model(const YamlMapping& rig) {
  if (!rig.has("lens")) return {};
  const std::string name = rig.text("lens");
  for (const LensModel model : {LensModel::none, LensModel::brown, LensModel::fisheye}) {
    if (name == lens_name(model)) return model;
  }
  rig.fail("lens", "'" + name + "', expected brown, fisheye or none");
}

LiveSettings live_settings(const YamlMapping& rig, const std::string& path) {
  LiveSettings live;
  live.fps = rig.number("frames_per_s", 0.001, 100000, live.fps);
  live.keys_folder = (fs::path(path).parent_path() / "keys").string();
  if (!rig.has("live")) return live;
  const YamlMapping y = rig.child("live", rig_keys("live"));
  live.address = y.text("address", live.address);
  live.deadline_s = y.number("deadline_s", 0.001, 1, live.deadline_s);
  live.bytes_per_s = y.number("most_bytes_per_s", 1000, 1e9, live.bytes_per_s);
  if (y.has("keys")) live.keys_folder = (fs::path(path).parent_path() / y.text("keys")).string();
  const std::string sync = y.text("sync", "time");
  if (sync != "time" && sync != "trigger" && sync != "software")
    y.fail("sync", "'" + sync + "', expected time, trigger or software");
  if (sync == "trigger") live.sync = LiveSync::trigger;
  if (sync == "software") live.sync = LiveSync::software;
  try {
    is_loopback(live.address);
  } catch (const Error& e) {
    y.fail("address", e.what());
  }
  return live;
}

Vec3f vec(const std::vector<double>& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

void read_world(const YamlMapping& yaml, RigFile& file) {
  const YamlMapping box = yaml.child("workspace_m", rig_keys("workspace_m"));
  file.rig.workspace_m = {vec(box.numbers("min", 3)), vec(box.numbers("max", 3))};
  const Vec3f e = file.rig.workspace_m.extent();
  if (!(e.x > 0 && e.y > 0 && e.z > 0)) yaml.fail("workspace_m", "max must be above min on every axis");
  if (!is_workspace(file.rig.workspace_m)) yaml.fail("workspace_m", kWorkspaceRange);
  if (yaml.has("frames")) {
    const auto range = yaml.numbers("frames", 2);
    if (range[0] < 0 || range[1] < range[0] || range[1] > 1e8) {
      yaml.fail("frames", "expected [first, last] with 0 <= first <= last");
    }
    file.first_frame = static_cast<int>(range[0]);
    file.last_frame = static_cast<int>(range[1]);
  }
  if (yaml.has("frames_per_s")) file.frames_per_s = yaml.number("frames_per_s", 0.001, 100000, 0);
  file.background = background_options(yaml);
}

Vec2i image_size(const YamlMapping& yaml) {
  const auto size = yaml.numbers("image_size_px", 2);
  if (!(size[0] >= 1 && size[1] >= 1 && size[0] <= 32768 && size[1] <= 32768))
    yaml.fail("image_size_px", "expected 1 to 32768 pixels");
  return {static_cast<Index>(size[0]), static_cast<Index>(size[1])};
}

/// Name and calibration of one camera, and its files by their key ("" where not given).
class CameraReader {
 public:
  CameraReader(const std::string& path, const YamlMapping& rig)
      : path_(path), rig_(rig), R_world_up_(transpose(rotation_to_y_up(rig))) {
    answers_.nodes = calibration_nodes(rig);
    answers_.lens = lens_model(rig);
    answers_.format = rig.text("calibration_format", "");
    answers_.unit_name = "'unit_m'";
    answers_.size_name = "'image_size_px'";
    answers_.format_name = "'calibration_format'";
    if (rig.has("unit_m")) answers_.unit_m = rig.number("unit_m", 1e-9, 1e9);
  }
  /// @param size that the pictures have where the camera itself says nothing
  CalibratedCamera read(const YamlMapping& y, std::optional<Vec2i> size) {
    const std::string name = y.text("name");
    if (!names_.insert(name).second) y.fail("name", "'" + name + "' stands here a second time");
    if (!y.has("calibration") && !rig_.has("calibration")) {
      y.fail("calibration",
             "camera '" + name +
                 "' has none; expected the path of a calibration (docs/rig.md lists the formats)");
    }
    answers_.image_size_px = y.has("image_size_px") ? image_size(y) : size;
    CalibratedCamera c;
    for_camera(path_, name, [&] {
      const std::string file = find_data((y.has("calibration") ? y : rig_).text("calibration"), path_);
      c = camera_of(load(file), y.text("calibration_camera", name), file).calibrated;
    });
    c.camera.name = name;
    c.camera.T_cam_world.R = c.camera.T_cam_world.R * R_world_up_;
    warn_of_principal_point(c.camera);
    return c;
  }
  /// Cropped pictures have it outside; but so has a calibration of larger pictures.
  void warn_of_principal_point(const Camera& c) const {
    if (c.cx_px >= -0.5 && c.cx_px <= c.width_px - 0.5 && c.cy_px >= -0.5 && c.cy_px <= c.height_px - 0.5)
      return;
    log_warning(path_ + ": camera '" + c.name + "': the principal point (" + number_text(c.cx_px) + ", " +
                number_text(c.cy_px) + ") lies outside the image of " + std::to_string(c.width_px) + "x" +
                std::to_string(c.height_px) +
                " pixels: right for cropped pictures, else the calibration belongs to another image size");
  }
  std::string data(const YamlMapping& y, const char* key) const {
    std::string found;
    if (y.has(key)) for_camera(path_, y.text("name"), [&] { found = find_data(y.text(key), path_); });
    return found;
  }

 private:
  /// A file of several cameras is read once for all that expect pictures of one size.
  const CalibrationData& load(const std::string& file) {
    const Vec2i size = answers_.image_size_px.value_or(Vec2i{});
    const auto [entry, is_new] = read_.try_emplace({file, size.x, size.y});
    if (is_new) entry->second = read_calibration_file(file, answers_);
    return entry->second;
  }

  std::string path_;
  const YamlMapping& rig_;
  Mat3d R_world_up_;
  CalibrationAnswers answers_;
  std::set<std::string> names_;
  std::map<std::tuple<std::string, Index, Index>, CalibrationData> read_;
};

DepthRecording read_depth_camera(const YamlMapping& y, CameraReader& reader) {
  DepthRecording r{reader.read(y, std::nullopt), reader.data(y, "depth"), y.text("device", ""), {}};
  if (r.images.empty() && r.device.empty())
    y.fail("depth", "expected the 16-bit PNG of the distances, or a pattern of them");
  r.encoding.unit_m = y.number("unit_m", 1e-6, 1e3, r.encoding.unit_m);
  const std::string distance = y.text("distance", "z");
  if (distance != "z" && distance != "radial")
    y.fail("distance", "'" + distance + "', expected z (along the optical axis) or radial");
  r.encoding.is_radial = distance == "radial";
  if (const std::string error = reader.data(y, "error_table"); !error.empty())
    r.encoding.error = read_depth_error(error);
  return r;
}

}  // namespace

std::string find_data(const std::string& path, const std::string& beside) {
  const fs::path wanted(path);
  const auto there = [](const fs::path& p) {
    const std::string text = p.string();
    const std::optional<NumberPlace> place = number_place(text);
    const std::size_t percent = place ? place->begin : text.find('%');
    if (is_there(p) || percent == std::string::npos) return is_there(p);
    const fs::path of_numbered = fs::path(text.substr(0, percent) + "x").parent_path();
    return of_numbered.empty() || is_there(of_numbered);
  };
  if (wanted.is_absolute()) {
    if (there(wanted)) return path;
    throw Error(path + ": no such file" + suggest_file(path));
  }
  std::vector<fs::path> folders{fs::path(beside).parent_path()};
  if (const char* data = std::getenv("TACTUS_DATA"); data != nullptr) folders.emplace_back(data);
  folders.emplace_back("../shared/data");
  std::string tried, near;
  for (const fs::path& folder : folders) {
    if (there(folder / wanted)) return folder / wanted;
    if (near.empty()) near = suggest_file(folder / wanted);
    tried += (tried.empty() ? "" : ", ") + (folder.empty() ? std::string(".") : folder.string());
  }
  throw Error(path + ": no such file in " + tried + " (set TACTUS_DATA to the folder of the data)" + near);
}

void for_camera(const std::string& path, const std::string& name, const std::function<void()>& body) {
  try {
    body();
  } catch (const Error& e) {
    throw Error(path + ": camera '" + name + "': " + e.what(), e.kind());
  }
}

RigFile read_rig_file(const std::string& path) {
  const YamlMapping yaml = YamlMapping::load(path, rig_keys(""));
  RigFile file;
  read_world(yaml, file);
  CameraReader reader(path, yaml);
  file.R_file_world = transpose(rotation_to_y_up(yaml));
  file.live = live_settings(yaml, path);
  const auto cameras = yaml.children("cameras", rig_keys("cameras[]"));
  std::optional<Vec2i> size;
  if (yaml.has("image_size_px")) size = image_size(yaml);
  if (cameras.empty()) yaml.fail("cameras", "no camera, expected at least one");
  for (const YamlMapping& y : cameras) {
    file.calibrated.push_back(reader.read(y, size));
    for_camera(path, file.calibrated.back().camera.name,
               [&] { file.rig.cameras.push_back(undistorted_camera(file.calibrated.back())); });
    file.videos.push_back(reader.data(y, "video"));
    file.backgrounds.push_back(reader.data(y, "empty_room"));
    file.masks.push_back(reader.data(y, "mask"));
    file.photos.push_back(reader.data(y, "photo"));
    file.devices.push_back(y.text("device", ""));
  }
  if (!yaml.has("depth_cameras")) return file;
  for (const YamlMapping& y : yaml.children("depth_cameras", rig_keys("depth_cameras[]")))
    file.depths.push_back(read_depth_camera(y, reader));
  return file;
}

}  // namespace tactus
