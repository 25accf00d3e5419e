#include "tactus/geom/camera/camera.h"

#include <cmath>

#include "tactus/base/error.h"
#include "tactus/geom/camera/place_limits.h"

namespace tactus {

Camera look_at(Vec3d eye_m, Vec3d target_m, Vec3d up, Index width_px, Index height_px, double focal_px) {
  const Vec3d z = normalized(target_m - eye_m);
  const Vec3d x = normalized(cross(z, up));
  const Mat3d R{{x, cross(z, x), z}};
  return {"", width_px,         height_px, focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1),
          0,  {R, -(R * eye_m)}};
}

void check_camera(const Camera& camera) {
  const auto fail = [&](const std::string& what) { throw Error("camera '" + camera.name + "': " + what); };
  if (camera.width_px <= 0 || camera.height_px <= 0) {
    fail("image size " + std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px) +
         ", expected positive");
  }
  for (const double f : {camera.fx_px, camera.fy_px}) {
    if (!(f >= kLeastFocal_px && f <= kMostFocal_px))
      fail("focal length " + number_text(f) + " px, expected " + number_text(kLeastFocal_px) + " to " +
           number_text(kMostFocal_px));
  }
  for (const double c : {camera.cx_px, camera.cy_px, camera.skew_px}) {
    if (!(std::abs(c) <= kMostFocal_px))
      fail("principal point or skew of " + number_text(c) + " px, expected at most " +
           number_text(kMostFocal_px));
  }
  const Mat3d& R = camera.T_cam_world.R;
  const Vec3d t = camera.T_cam_world.t;
  const Mat3d off = R * transpose(R) - Mat3d::identity();
  double worst = 0;
  for (const Vec3d& row : off.row)
    worst = std::max(worst, std::abs(row.x) + std::abs(row.y) + std::abs(row.z));
  if (!(worst < 1e-3) || !(determinant(R) > 0)) {
    fail("its rotation is not a rotation (|R R^T - I| = " + std::to_string(worst) +
         ", det R = " + std::to_string(determinant(R)) + ")");
  }
  for (const double c : {t.x, t.y, t.z}) {
    if (!(std::abs(c) <= kMostPlace_m))
      fail("translation of " + number_text(c) + " m, expected at most " + number_text(kMostPlace_m) +
           " (is its unit right?)");
  }
}

}  // namespace tactus
