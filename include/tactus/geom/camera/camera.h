#pragma once
/// Pinhole cameras, OpenCV's conventions: x right, y down, z forward; the centre of the top-left pixel is
/// (0,0). Lenses are in lens.h.
#include <string>

#include "tactus/base/vec.h"

namespace tactus {

/// A camera without distortion, posed in the world: pixel ~ K [R|t] p_world. The principal point may lie
/// outside the image (of a cropped picture it does).
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
/// The 3x4 matrix K [R|t] in two parts: (u w, v w, w) = M p_world + t.
struct Projection {
  Mat3d M = Mat3d::identity();
  Vec3d t;
};
inline Projection projection(const Camera& camera) {
  const Mat3d K = camera.intrinsics();
  return {K * camera.T_cam_world.R, K * camera.T_cam_world.t};
}
/// Fills a camera as kernels hold it: `row` and `offset` of its projection, and its size. Points have their
/// origin at `origin_m` of the world and come in units of `unit_m`.
template <class DeviceCamera>
void set_projection(DeviceCamera& to, const Camera& camera, Vec3d origin_m = {}, double unit_m = 1) {
  const Projection p = projection(camera);
  const Vec3d t = p.t + p.M * origin_m;
  for (int i = 0; i < 3; ++i) {
    to.row[i] = vec_cast<float>(unit_m * p.M.row[i]);
    to.offset[i] = static_cast<float>(t[i]);
  }
  to.width_px = camera.width_px;
  to.height_px = camera.height_px;
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
