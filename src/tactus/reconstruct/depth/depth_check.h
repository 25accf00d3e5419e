#pragma once
/// Does a depth image agree with the silhouettes? Finds wrong units, z given as radial distance and radial
/// distance given as z.
#include <span>
#include <string>

#include "tactus/geom/camera/camera.h"
#include "tactus/geom/image/image.h"

namespace tactus {

/// Measured points of the object lie inside every silhouette that sees them; those of the background lie
/// outside under any reading. Counts the points of about 300 measured pixels that lie inside the workspace
/// and inside every silhouette, as given and as other readings of the same numbers (millimetres, kilometres,
/// z instead of radial distance, radial distance that was taken for z). A point may lie up to two standard
/// deviations of the image's own noise behind its distance: noise alone is no wrong unit; nor are masks that
/// lost a rim: z is named only where it explains nearly all points and masks that are a few pixels too small
/// don't. Returns "" when the image as given is at least nearly as good as any other reading; else the
/// likelier reading, with the counts. Near the optical axis, z and radial distance are the same, and points
/// that are read too far show only where the object is thin or slanted enough for them to leave the hull at
/// its back: nothing is said of a thick or flat object that faces the camera. Empty images and masks take no
/// part; without a silhouette nothing is said. Allocates nothing; about 40 us when all is well, several times
/// that when masks are too small.
std::string depth_inconsistency(std::span<const Camera> cameras, std::span<const BitMask> silhouettes,
                                const Camera& depth_camera, const DepthImage& depth_m, Box3f workspace_m);

}  // namespace tactus
