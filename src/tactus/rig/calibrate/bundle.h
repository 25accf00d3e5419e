#pragma once
/// Cameras, lenses and board poses, refined together so that every corner lands where it was seen. [Zhang
/// 2000 for the start; Triggs et al. 1999 for the rest]
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/rig/calibrate/board.h"

namespace tactus {

struct BundleOptions {
  bool refine_intrinsics = true;      ///< else K and lens stay as they are given
  LensModel lens = LensModel::brown;  ///< of cameras that come without one
  int lens_coefficients = 5;          ///< brown: 2, 4, 5 or 8 that are refined
  bool fix_aspect = false;            ///< fx = fy
  double loss_px = 2;                 ///< residuals beyond count linearly (Huber); 0: all count squared
  double outlier_factor = 4;          ///< views whose RMS is so many times the median are left out; 0: none
};

/// Standard deviations, from the residuals' own scatter. Poses: in the frame of the first camera, which has
/// none.
struct CameraDeviations {
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  std::vector<double> lens;  ///< of the refined coefficients
  Vec3d rotation_rad, center_m;
};

struct ViewResidual {
  Index camera = 0, instant = 0, corners = 0;
  double rms_px = 0;
  bool left_out = false;  ///< an outlier: not used
};

struct BundleResult {
  std::vector<CalibratedCamera> cameras;  ///< the frame of the first is the world
  std::vector<CameraDeviations> deviations;
  std::vector<std::optional<Rigidd>> T_world_board;  ///< by instant
  std::vector<ViewResidual> views;
  std::vector<double> camera_rms_px;  ///< root of the mean square distance of corners
  double rms_px = 0;
  std::int64_t corners = 0;  ///< that were used
  /// Covariance of the free parameters of all cameras, row by row; order: per camera the refined intrinsics
  /// (fx fy cx cy lens), and from the second camera on the small turn d (R becomes R(d) R) and the
  /// translation of T_cam_world.
  std::vector<double> covariance;
  Index camera_parameters = 0;
};

/// Lenses of cameras that have none, from their own views. @param size_px by camera
/// @throws Error naming the camera: too few views. @throws Error where Tactus was built without Ceres.
std::vector<CalibratedCamera> calibrate_lenses(const Board& board, std::span<const BoardView> views,
                                               std::span<const std::string> names,
                                               std::span<const Vec2i> size_px, const BundleOptions& options);

/// Poses (and lenses) of cameras that see a board at common instants. `cameras` come with K and lens; poses
/// are found.
/// @throws Error naming a camera that shares no instant with the others and those that it should share one
/// with.
BundleResult calibrate_poses(const Board& board, std::span<const BoardView> views,
                             std::span<const CalibratedCamera> cameras, const BundleOptions& options);

/// Why nothing can be calibrated by this build; "" when it can.
std::string calibration_missing();

}  // namespace tactus
