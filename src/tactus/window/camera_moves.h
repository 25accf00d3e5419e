#pragma once
/// A camera that is moved by the mouse, and places under it.
#include <optional>

#include "tactus/view/view_camera.h"

namespace tactus {

/// A place on a picture, in pixels from its upper left corner, or a way on it.
struct PicturePoint {
  float x = 0, y = 0;
};

/// Turns about the target: the height of the picture is half a turn. The horizon stays level.
void orbit(ViewCamera& camera, PicturePoint by_px, float height_px);
/// Moves the target, so that it stays under the mouse.
void pan(ViewCamera& camera, PicturePoint by_px, float height_px);
/// Goes nearer, by a tenth of the distance a step; away for steps below 0.
void zoom(ViewCamera& camera, float steps);

/// Where a point is on the picture; nothing behind the eye.
std::optional<PicturePoint> project(const ViewCamera& camera, Vec3f at_m, PicturePoint size_px);
/// The point under a place of the picture, at this distance from the eye along the camera's axis.
Vec3f point_under(const ViewCamera& camera, PicturePoint at_px, PicturePoint size_px, float depth_m);
/// Distance of a point from the eye, along the camera's axis.
float depth_m(const ViewCamera& camera, Vec3f at_m);

}  // namespace tactus
