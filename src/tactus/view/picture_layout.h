#pragma once
/// Where everything of a picture is, and the matrices that follow from it. Internal to view/.
#include "tactus/view/gl_liquid.h"
#include "tactus/view/projection.h"
#include "tactus/view/scene.h"
#include "tactus/view/view_camera.h"

namespace tactus {

struct PictureLayout {
  /// Bounds of the meshes that cast shadows, as far as they are near the picture: a part that has fallen deep
  /// or flown far doesn't widen it. Where there are none, a small box around the camera's target.
  Box3f box;
  Vec3f sun;  ///< unit vector towards the key light
  float radius_m, reach_m, ground_radius_m, near_m;
  float floor_m;  ///< zero of the heights: the ground, else the lowest point of the box
  Vec3f ground_center;
  Vec3f sun_half_m;  ///< half sides of the sun map's box, along its axes; z is towards the sun
  Vec3f sky_half_m;  ///< of the map of heights
  Box3f lit_m;       ///< (x, z) part of the ground where shadow or occlusion may be
  bool has_ground;
  Vec3f eye_m;
  LiquidProjection eye;
  Mat4 view_proj, sun_clip, sky_clip;
};

/// @param aspect width over height of the picture
/// @param seen_by looks instead of the camera, which then only says where light and ground are
PictureLayout lay_out(const ViewScene& scene, const ViewCamera& camera, float aspect,
                      const ViewEye* seen_by = nullptr);

}  // namespace tactus
