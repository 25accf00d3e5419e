#pragma once
/// Azure Kinect: the factory calibration as the device stores it, and folders with one capture.
#include <memory>
#include <string>

#include "tactus/geom/camera/lens.h"
#include "tactus/rig/images/camera_file.h"
#include "tactus/rig/images/depth_images.h"
#include "tactus/rig/sources/data_sources.h"

namespace tactus {

/// Depth mode NFOV unbinned (640x576) and colour 16:9 of any size. Distortion: k1 k2 p1 p2 k3 k4 k5 k6.
/// World: +Y up, the depth camera at the origin looks along -z.
struct KinectCalibration {
  CalibratedCamera depth, color;
  double depth_metric_radius = 0;  ///< |(x/z, y/z)| up to which the lens model holds; 0: everywhere
};
/// @throws Error naming the file and the field that is missing, of a wrong shape or not finite.
KinectCalibration read_kinect_calibration(const std::string& file, Index color_width_px,
                                          Index color_height_px);

/// A folder with calibration.json, depth*.png (16 bit, z in mm) and color*.jpg or color*.png: one frame.
/// Nobody gives silhouettes, so the depth camera is the camera of one, too: of the pixels at which it
/// measures a point in the workspace. The hull is then the space behind the measured surface, to the far side
/// of the workspace (2.3 m from the camera when the options say nothing else); objects that were not
/// measured, or lie outside the field of view, are not in it. The colour camera has no silhouette.
/// @throws Error naming the file, or when nothing was measured in the workspace; usage Error for a workspace
/// that is not before the camera.
std::unique_ptr<FrameSource> open_kinect(const std::string& folder, const DataOptions& options = {});

}  // namespace tactus
