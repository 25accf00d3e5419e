#pragma once
/// The common part of COLMAP's text and binary files. Pixel centres at one half; world to camera; quaternions
/// with w first; no unit.
#include <map>

#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {

struct ColmapModel {
  int id;
  const char* name;
  std::size_t parameters;
};
/// nullptr for an unknown one.
const ColmapModel* colmap_model(int id);
const ColmapModel* colmap_model(const std::string& name);

/// Intrinsics and lens from a model's parameters. @param where "FILE:LINE" for messages
/// @throws Error for a model that is no pinhole with our lenses, by its name.
CalibratedCamera colmap_camera(const ColmapModel& model, Vec2i size_px, std::span<const double> parameters,
                               const std::string& where);

/// A picture of the reconstruction: a camera of the rig.
struct ColmapImage {
  std::string name;
  double q_wxyz[4];
  Vec3d t;
  std::uint32_t camera_id;
};
/// Cameras named like the pictures without their extension (with their folders).
std::vector<FileCamera> colmap_rig(const std::map<std::uint32_t, CalibratedCamera>& lenses,
                                   std::span<const ColmapImage> images, const std::string& path,
                                   const CalibrationAnswers& answers);
/// The folder with cameras.EXT and images.EXT when the input is it or one of the two; "" otherwise.
std::string colmap_folder(const Input& input, const char* extension);

}  // namespace tactus::calibration
