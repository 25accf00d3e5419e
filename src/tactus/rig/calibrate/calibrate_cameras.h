#pragma once
/// From corners of a board in pictures to cameras: lenses, poses, and the files that say so.
#include "tactus/rig/calibrate/board_pictures.h"
#include "tactus/rig/calibrate/report.h"

namespace tactus {

/// @param lens "brown" or "fisheye" @param coefficients of a brown one: 2, 4, 5 or 8
/// @throws usage Error naming the wrong one.
BundleOptions lens_options(const std::string& lens, int coefficients);

struct CalibrateCamerasOptions {
  BundleOptions bundle;
  /// One per camera; none: from the same pictures.
  std::vector<CalibratedCamera> lenses;
  bool refine_lenses = false;  ///< those that are given
  std::optional<Index> floor;  ///< instant at which the board lies on the floor; none: see below
};

/// Lenses and poses of cameras, by a board that they see at common instants. Without a floor, the world of a
/// rig is its first camera's, taken as level: +Y up. One camera alone is the world itself.
/// @throws Error as calibrate_lenses, calibrate_poses and world_on_board.
CalibrationReport calibrate_cameras(const Board& board, const BoardPictures& seen,
                                    std::span<const std::string> names,
                                    const CalibrateCamerasOptions& options);

/// A report's cameras in the world that is written.
std::vector<CalibratedCamera> cameras_in_world(const CalibrationReport& report);

/// FOLDER/rig.yaml, FOLDER/cameras.json, and a page with pictures. @throws Error naming the file.
void write_rig_calibration(const CalibrationReport& report, const std::string& folder,
                           const std::string& page);
/// One camera's lens as OpenCV YAML. @throws Error naming the file.
void write_lens_calibration(const CalibrationReport& report, const std::string& path);
/// The page with pictures. @throws Error naming the file.
void write_calibration_page(const CalibrationReport& report, const std::string& path);

}  // namespace tactus
