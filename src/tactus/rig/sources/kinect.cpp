#include "tactus/rig/sources/kinect.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/base/foreign_text.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/sources/frame_window.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

std::vector<double> numbers(const nlohmann::json& json, const std::string& what, const char* key,
                            std::size_t count) {
  const auto field = json.find(key);
  if (field == json.end() || !field->is_array() || field->size() < count)
    throw Error(what + ": expected '" + key + "' with " + std::to_string(count) + " numbers");
  std::vector<double> values;
  for (const nlohmann::json& value : *field) {
    if (!value.is_number() || !std::isfinite(value.get<double>()))
      throw Error(what + ": '" + key + "' holds " + value.dump() + ", expected a finite number");
    values.push_back(value.get<double>());
  }
  return values;
}

/// Where a mode's image lies in the sensor: cropped by these pixels at the top left, then scaled.
struct Crop {
  double width_px, height_px, left_px, top_px, scale;
};

CalibratedCamera read_camera(const nlohmann::json& json, const std::string& what, Crop crop, Index width_px,
                             Index height_px) {
  if (!json.contains("Intrinsics") || !json.contains("Rt"))
    throw Error(what + ": expected 'Intrinsics' and 'Rt'");
  // cx cy fx fy (over the sensor's size, pixel corners at whole numbers), k1..k6, centre of distortion, p2
  // p1.
  const std::vector<double> p = numbers(json["Intrinsics"], what, "ModelParameters", 14);
  const std::vector<double> R = numbers(json["Rt"], what, "Rotation", 9),
                            t = numbers(json["Rt"], what, "Translation", 3);
  CalibratedCamera out;
  Camera& camera = out.camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.cx_px = (p[0] * crop.width_px - crop.left_px) * crop.scale - 0.5;
  camera.cy_px = (p[1] * crop.height_px - crop.top_px) * crop.scale - 0.5;
  camera.fx_px = p[2] * crop.width_px * crop.scale;
  camera.fy_px = p[3] * crop.height_px * crop.scale;
  const Mat3d R_cam_depth{{{R[0], R[1], R[2]}, {R[3], R[4], R[5]}, {R[6], R[7], R[8]}}};
  const Mat3d R_depth_world{{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  camera.T_cam_world = {R_cam_depth * R_depth_world, {t[0], t[1], t[2]}};
  out.lens = make_lens(LensModel::brown, std::vector{p[4], p[5], p[13], p[12], p[6], p[7], p[8], p[9]});
  return out;
}

/// First file of the folder whose name starts and ends so; "" when there is none.
std::string find_file(const std::string& folder, const std::string& begin,
                      const std::vector<std::string>& ends) {
  std::vector<std::string> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    for (const std::string& end : ends) {
      if (name.starts_with(begin) && name.ends_with(end)) found.push_back(entry.path());
    }
  }
  return found.empty() ? "" : *std::min_element(found.begin(), found.end());
}

/// Neighbouring pixels that differ by more lie on two surfaces: neither is seen for sure.
constexpr float kJump_m = 0.1F;
/// The optical axis is -z: the nearest that a workspace may come, and the widest silhouette it may ask for.
constexpr float kNearest_m = 0.1F;
constexpr double kWidest_px = 8192;

/// The depth camera once more, as the camera of a silhouette: its image is so much larger that it holds all
/// of the workspace. Pixels outside the field of view are background there, and not unknown.
Camera silhouette_camera(const Camera& depth, const Box3f& workspace_m, const std::string& folder) {
  if (!(workspace_m.max.z <= -kNearest_m))
    throw usage_error(folder +
                      ": the workspace ends at z = " + number_text(workspace_m.max.z, -double{kNearest_m}) +
                      " m; a depth camera alone sees what lies before it, along -z: expected at most -0.1 m");
  double left = 0, top = 0, right = depth.width_px - 1, bottom = depth.height_px - 1;
  for (int i = 0; i < 8; ++i) {
    const auto pick = [](bool high, float a, float b) { return static_cast<double>(high ? a : b); };
    const Pixel p = project(depth, {pick((i & 1) != 0, workspace_m.max.x, workspace_m.min.x),
                                    pick((i & 2) != 0, workspace_m.max.y, workspace_m.min.y),
                                    pick((i & 4) != 0, workspace_m.max.z, workspace_m.min.z)});
    left = std::min(left, std::floor(p.u_px) - 1);
    right = std::max(right, std::ceil(p.u_px) + 1);
    top = std::min(top, std::floor(p.v_px) - 1);
    bottom = std::max(bottom, std::ceil(p.v_px) + 1);
  }
  if (std::max(right - left, bottom - top) >= kWidest_px)
    throw usage_error(folder + ": the workspace is too wide for how near it comes to the depth camera (z = " +
                      number_text(workspace_m.max.z) + " m): let it begin farther off, or make it narrower");
  Camera camera = depth;
  camera.cx_px -= left;
  camera.cy_px -= top;
  camera.width_px = static_cast<Index>(right - left) + 1;
  camera.height_px = static_cast<Index>(bottom - top) + 1;
  return camera;
}

/// Per pixel 1 where a distance was measured and no neighbour lies on another surface.
Image<std::uint8_t> usable_pixels(const DepthImage& depth_m) {
  Image<std::uint8_t> usable(depth_m.width_px, depth_m.height_px);
  for (Index y = 1; y + 1 < depth_m.height_px; ++y) {
    for (Index x = 1; x + 1 < depth_m.width_px; ++x) {
      const float e = depth_m(x, y);
      const auto agrees = [&](float other) { return std::abs(other - e) <= kJump_m; };
      usable(x, y) = e > 0 && agrees(depth_m(x - 1, y)) && agrees(depth_m(x + 1, y)) &&
                             agrees(depth_m(x, y - 1)) && agrees(depth_m(x, y + 1))
                         ? 1
                         : 0;
    }
  }
  return usable;
}

/// Where the depth camera measures something in the workspace, with a pixel of margin: so up to the
/// silhouette's contour, half a pixel on, depth is known and carves. `silhouette` is the camera's larger
/// image.
BitMask measured_in(const Box3f& workspace_m, const Camera& depth, const DepthImage& depth_m,
                    const Camera& silhouette) {
  BitMask mask(silhouette.width_px, silhouette.height_px);
  const auto left = static_cast<Index>(std::lround(silhouette.cx_px - depth.cx_px)),
             top = static_cast<Index>(std::lround(silhouette.cy_px - depth.cy_px));
  const Image<std::uint8_t> usable = usable_pixels(depth_m);
  const Vec3d eye = depth.center_world();
  for (Index y = 1; y + 1 < depth_m.height_px; ++y) {
    for (Index x = 1; x + 1 < depth_m.width_px; ++x) {
      int around = 0;
      for (Index k = 0; k < 9; ++k) around += usable(x - 1 + k % 3, y - 1 + k / 3);
      if (around < 9) continue;
      const Vec3f p =
          vec_cast<float>(eye + static_cast<double>(depth_m(x, y)) * pixel_ray_world(depth, x, y));
      if (max(min(p, workspace_m.max), workspace_m.min) == p) mask.set(left + x, top + y);
    }
  }
  return mask;
}

class KinectSource final : public FrameSource {
 public:
  KinectSource(const std::string& folder, const DataOptions& options) {
    if (!fs::is_directory(folder)) throw Error(folder + ": no such folder" + suggest_file(folder));
    frame_window(folder, options.first_frame, options.last_frame, {0, 0});
    const std::string depth = find_file(folder, "depth", {".png"}),
                      color = find_file(folder, "color", {".jpg", ".png"});
    if (depth.empty()) throw Error(folder + ": no depth*.png");
    if (color.empty()) throw Error(folder + ": no color*.jpg or color*.png");
    color_ = read_photo(color);
    const KinectCalibration calibration =
        read_kinect_calibration(folder + "/calibration.json", color_.width_px, color_.height_px);
    const Camera& tof = calibration.depth.camera;
    rig_.depth_cameras = {tof};
    rig_.workspace_m = options.workspace_m.value_or(Box3f{{-1, -1, -2.3F}, {1, 1, -0.3F}});
    DepthUndistortion(calibration.depth, {.metric_radius = calibration.depth_metric_radius})
        .radial_m(read_depth_png(depth, tof.width_px, tof.height_px), depth_m_);
    with_colors_ = options.colors;
    rig_.cameras = {calibration.color.camera, silhouette_camera(tof, rig_.workspace_m, folder)};
    measured_ = measured_in(rig_.workspace_m, tof, depth_m_, rig_.cameras[1]);
    if (measured_.area_px() == 0)
      throw Error(
          depth + ": no point of it lies in the workspace, x " + number_text(rig_.workspace_m.min.x) +
          " to " + number_text(rig_.workspace_m.max.x) + ", y " + number_text(rig_.workspace_m.min.y) +
          " to " + number_text(rig_.workspace_m.max.y) + ", z " + number_text(rig_.workspace_m.min.z) +
          " to " + number_text(rig_.workspace_m.max.z) +
          " m (the camera is at the origin and looks along -z); expected a box with the object in it");
  }
  const Rig& rig() const override { return rig_; }
  std::optional<int> frame_count() const override { return 1; }
  NextFrame next(FrameSet& frame) override {
    if (done_) return NextFrame::no_more_data;
    done_ = true;
    frame = {};
    frame.silhouettes = {{}, measured_};
    if (with_colors_) frame.colors = {color_, {}};
    frame.depths_m = {depth_m_};
    return NextFrame::success;
  }
  std::string status() const override {
    return "one depth camera and no silhouettes: what is hidden behind the surface that it sees counts as "
           "solid, to the far side of the workspace; the volume is no measurement of the object's";
  }

 private:
  Rig rig_;
  ColorImage color_;
  DepthImage depth_m_;
  BitMask measured_;  ///< in the larger image of the depth camera
  bool with_colors_ = true, done_ = false;
};

}  // namespace

KinectCalibration read_kinect_calibration(const std::string& file, Index color_width_px,
                                          Index color_height_px) {
  if (!fs::exists(file)) throw Error(file + ": no such file");
  // The device ends its text with a zero byte, some tools keep it.
  std::string text = read_text(file, kMaxCalibrationBytes, ReadFrom::regular_file);
  while (!text.empty() && text.back() == '\0') text.pop_back();
  check_foreign_text(text, TextSyntax::json, file);
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  if (json.is_discarded()) throw Error(file + ": not JSON");
  if (color_height_px * 16 != color_width_px * 9)
    throw Error(file + ": a colour image of " + std::to_string(color_width_px) + "x" +
                std::to_string(color_height_px) + " pixels; only the 16:9 modes are known");
  const auto camera = [&](const std::string& purpose) -> const nlohmann::json& {
    const nlohmann::json::json_pointer at("/CalibrationInformation/Cameras");
    if (json.contains(at) && json[at].is_array()) {
      for (const nlohmann::json& c : json[at]) {
        const bool named = c.is_object() && c.contains("Purpose") && c["Purpose"].is_string();
        if (named && c["Purpose"] == "CALIBRATION_CameraPurpose" + purpose) return c;
      }
    }
    throw Error(file + ": no camera with the purpose CALIBRATION_CameraPurpose" + purpose);
  };
  KinectCalibration out;
  // NFOV unbinned: 640x576 pixels of the 1024x1024 sensor from (192, 180).
  out.depth = read_camera(camera("Depth"), file + ": depth camera", {1024, 1024, 192, 180, 1}, 640, 576);
  out.depth.camera.name = "depth";
  const auto radius = camera("Depth").find("MetricRadius");
  if (radius != camera("Depth").end() && radius->is_number()) out.depth_metric_radius = radius->get<double>();
  // 16:9: the middle 2304 of the 3072 rows of the 4096 wide sensor.
  out.color = read_camera(camera("PhotoVideo"), file + ": colour camera",
                          {4096, 3072, 0, 384, color_width_px / 4096.0}, color_width_px, color_height_px);
  out.color.camera.name = "color";
  check_camera(out.depth.camera);
  check_camera(out.color.camera);
  return out;
}

std::unique_ptr<FrameSource> open_kinect(const std::string& folder, const DataOptions& options) {
  return std::make_unique<KinectSource>(folder, options);
}

}  // namespace tactus
