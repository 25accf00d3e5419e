#pragma once
/// Evidence of a rig's scale and timing: a board whose corners were clicked in every picture, and the times
/// of frames.
#include <string>
#include <vector>

#include "tactus/geom/camera/lens.h"

namespace tactus {

/// A board of `columns` x `rows` inner corners, a square `square_m` wide, as the corners were clicked: row by
/// row.
struct ClickedBoard {
  Index columns = 0, rows = 0;
  double square_m = 0;
};

/// Corners of one picture: OpenCV XML or YAML with CornersAmount and Corner_0 .. of two numbers.
/// @throws Error naming file and node, or how many corners were expected.
std::vector<Vec2d> read_clicked_corners(const std::string& file, const ClickedBoard& board);

struct BoardPose {
  Vec3d center_m;     ///< of the camera in the board's frame
  double rms_px = 0;  ///< of the corners
};
/// Where the camera stands before the board, by its lens and the corners (perspective n-point, refined).
/// @throws Error naming the camera when there is no such pose.
BoardPose pose_from_board(const CalibratedCamera& calibrated, const ClickedBoard& board,
                          const std::vector<Vec2d>& corners_px);

/// How far apart in time the cameras' frames of one tick are.
struct FrameSkew {
  double median_ms = 0, largest_ms = 0;
  std::size_t ticks = 0, cameras = 0;
};
/// CSV with a header that has sync_index, cam_id and frame_time [s] in any order. A tick's skew is the
/// largest difference of its frames' times. @throws Error naming file, line and column.
FrameSkew read_frame_skew(const std::string& file);

}  // namespace tactus
