#pragma once
/// Pinhole cameras, OpenCV's conventions: x right, y down, z forward; the centre of the top-left pixel is
/// (0,0).
#include <string>

#include "tactus/base/vec.h"

namespace tactus {

/// A camera without distortion, posed in the world: pixel ~ K [R|t] p_world.
struct Camera {
  std::string name;
  Index width_px = 0, height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  double skew_px = 0;
  Rigidd T_cam_world;  ///< world point to camera point [m]

  Vec3d center_world() const { return inverse(T_cam_world).t; }
  /// Unit vector of the optical axis in the world.
  Vec3d axis_world() const { return T_cam_world.R.row[2]; }
  Mat3d intrinsics() const { return {{{fx_px, skew_px, cx_px}, {0, fy_px, cy_px}, {0, 0, 1}}}; }
};

/// Projection of a point; z_m <= 0 is behind the camera, where u and v mean nothing.
struct Pixel {
  double u_px = 0, v_px = 0, z_m = 0;
};
inline Pixel project(const Camera& camera, Vec3d p_world) {
  const Vec3d p = camera.T_cam_world * p_world;
  return {(camera.fx_px * p.x + camera.skew_px * p.y) / p.z + camera.cx_px,
          camera.fy_px * p.y / p.z + camera.cy_px, p.z};
}
/// Unit direction in the world of the ray through a pixel.
inline Vec3d pixel_ray_world(const Camera& camera, double u_px, double v_px) {
  const double y = (v_px - camera.cy_px) / camera.fy_px;
  const double x = (u_px - camera.cx_px - camera.skew_px * y) / camera.fx_px;
  return normalized(transpose(camera.T_cam_world.R) * Vec3d{x, y, 1});
}
/// A camera at `eye` that looks at `target`; `up` points to the top of the image.
Camera look_at(Vec3d eye_m, Vec3d target_m, Vec3d up, Index width_px, Index height_px, double focal_px);

/// @throws Error naming the camera and the bad value: NaN, focal length <= 0, image size <= 0, R not a
/// rotation.
void check_camera(const Camera& camera);

}  // namespace tactus
