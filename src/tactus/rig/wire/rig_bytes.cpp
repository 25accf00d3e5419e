#include "tactus/rig/wire/rig_bytes.h"

#include <cmath>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/geom/camera/place_limits.h"
#include "tactus/rig/wire/image_coder.h"

namespace tactus {
namespace {

constexpr std::size_t kMostNameBytes = 256;

void put_cameras(const std::vector<Camera>& cameras, std::string& to) {
  put_bytes(to, static_cast<std::uint32_t>(cameras.size()));
  for (const Camera& camera : cameras) {
    const std::string_view name = std::string_view(camera.name).substr(0, kMostNameBytes);
    put_bytes(to, static_cast<std::uint32_t>(name.size()));
    to += name;
    put_bytes(to, static_cast<std::int32_t>(camera.width_px));
    put_bytes(to, static_cast<std::int32_t>(camera.height_px));
    for (const double v : {camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, camera.skew_px})
      put_bytes(to, v);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) put_bytes(to, camera.T_cam_world.R(i, j));
    }
    for (int i = 0; i < 3; ++i) put_bytes(to, camera.T_cam_world.t[i]);
  }
}

Camera take_camera(ByteReader& from) {
  Camera camera;
  const auto name_bytes = from.take<std::uint32_t>();
  if (name_bytes > kMostNameBytes) from.fail();
  camera.name = from.failed() ? "" : printable(from.take(name_bytes));
  camera.width_px = from.take<std::int32_t>();
  camera.height_px = from.take<std::int32_t>();
  for (double* v : {&camera.fx_px, &camera.fy_px, &camera.cx_px, &camera.cy_px, &camera.skew_px})
    *v = from.take<double>();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) camera.T_cam_world.R(i, j) = from.take<double>();
  }
  for (int i = 0; i < 3; ++i) camera.T_cam_world.t[i] = from.take<double>();
  if (from.failed()) throw Error("its cameras are cut short");
  check_camera(camera);
  if (static_cast<std::uint64_t>(camera.width_px) * static_cast<std::uint64_t>(camera.height_px) >
      kMostImagePixels)
    throw Error("camera '" + camera.name + "': image size " + std::to_string(camera.width_px) + "x" +
                std::to_string(camera.height_px) + ", expected at most " + std::to_string(kMostImagePixels) +
                " pixels");
  return camera;
}

std::vector<Camera> take_cameras(ByteReader& from) {
  const auto count = from.take<std::uint32_t>();
  if (from.failed() || count > kMostCameras)
    throw Error("it names " + std::to_string(count) + " cameras, expected at most " +
                std::to_string(kMostCameras));
  std::vector<Camera> cameras;
  for (std::uint32_t i = 0; i < count; ++i) cameras.push_back(take_camera(from));
  return cameras;
}

}  // namespace

void put_rig(const Rig& rig, std::string& to) {
  for (const Vec3f& v : {rig.workspace_m.min, rig.workspace_m.max}) {
    for (int i = 0; i < 3; ++i) put_bytes(to, v[i]);
  }
  put_bytes(to, static_cast<std::int32_t>(rig.slack_px));
  put_cameras(rig.cameras, to);
  put_cameras(rig.depth_cameras, to);
}

Rig take_rig(ByteReader& from) {
  Rig rig;
  for (Vec3f* v : {&rig.workspace_m.min, &rig.workspace_m.max}) {
    for (int i = 0; i < 3; ++i) (*v)[i] = from.take<float>();
  }
  rig.slack_px = from.take<std::int32_t>();
  for (int i = 0; i < 3; ++i) {
    const float low = rig.workspace_m.min[i], high = rig.workspace_m.max[i];
    if (!std::isfinite(low) || !std::isfinite(high) || !(low < high))
      throw Error("its workspace is no box: " + number_text(low) + " to " + number_text(high) + " m");
  }
  if (!is_workspace(rig.workspace_m)) throw Error(std::string("its workspace: ") + kWorkspaceRange);
  if (rig.slack_px < 0 || rig.slack_px > 1000)
    throw Error("its slack is " + std::to_string(rig.slack_px) + " px, expected 0 to 1000");
  rig.cameras = take_cameras(from);
  rig.depth_cameras = take_cameras(from);
  if (rig.cameras.empty()) throw Error("it has no cameras");
  return rig;
}

}  // namespace tactus
