#pragma once
/// First guesses: where a board is before one camera, and how cameras stand to one another.
#include <optional>
#include <span>

#include "tactus/rig/calibrate/board.h"

namespace tactus {

/// T_cam_board from one view; none where it has less than six corners, they lie on a line, or nothing fits.
std::optional<Rigidd> board_pose(const Board& board, const BoardView& view, const CalibratedCamera& camera);

/// Focal lengths from the views' homographies, principal point in the middle, no lens.
/// @throws Error naming the camera when less than three views have enough corners.
CalibratedCamera first_intrinsics(const Board& board, std::span<const BoardView> views, Index camera,
                                  const std::string& name, Vec2i size_px);

/// T_cam_first of every camera, along the tree of the pairs that share most views.
/// @param poses T_cam_board of each view  @throws Error naming cameras without a shared view.
std::vector<Rigidd> first_poses(std::span<const BoardView> views,
                                std::span<const std::optional<Rigidd>> poses,
                                std::span<const CalibratedCamera> cameras);

}  // namespace tactus
