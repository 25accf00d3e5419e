#pragma once
/// The camera of the picture: it orbits a target.
#include "tactus/base/vec.h"

namespace tactus {

struct ViewCamera {
  Vec3f target_m{};
  float distance_m = 1;
  float azimuth_rad = 0.6F;    ///< about +y; 0 looks from +z, pi/2 from +x
  float elevation_rad = 0.4F;  ///< above the horizon, within +-1.55
  float fov_rad = 0.6F;        ///< vertical angle of the picture, 0.01 to 2.5

  Vec3f eye_m() const;
  /// World to camera: x right, y up, the camera looks along -z.
  Rigidf T_cam_world() const;
};

/// An eye of a headset: its pose and the tangents of the edges of its picture, which need not be alike.
struct ViewEye {
  Rigidf T_world_eye;                             ///< x right, y up, the eye looks along -z
  float left = -1, right = 1, down = -1, up = 1;  ///< signed: those left of the axis or below it are negative
  float near_m = 0.05F, far_m = 50;               ///< nothing nearer or farther is drawn
};

/// Looks at the whole of `box_m` from the given side, for a picture of `aspect` = width / height.
/// @throws Error when the box is empty or not finite.
ViewCamera frame_box(const Box3f& box_m, float azimuth_rad = 0.6F, float elevation_rad = 0.4F,
                     float aspect = 16.F / 9.F, float fov_rad = 0.6F);

}  // namespace tactus
