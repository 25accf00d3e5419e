#pragma once
/// The result of a calibration as one HTML file with pictures, and as a rig file.
#include <string>

#include "tactus/rig/calibrate/bundle.h"

namespace tactus {

struct CalibrationReport {
  Board board;
  std::vector<BoardView> views;
  std::vector<Index> picture_count;  ///< by camera
  BundleResult result;
  Rigidd T_world_first;  ///< from the first camera's frame to the world that is written
};

/// Coverage, residuals, parameters with standard deviations, views that were left out, the rig from above.
std::string calibration_html(const CalibrationReport& report);

/// Box of the board's places, with 10 % more on every side; the world has +Y up.
Box3f board_workspace(const CalibrationReport& report);
/// A rig file that reads `calibration` beside it. Cameras' masks and films are for the user to fill in.
std::string rig_yaml(const CalibrationReport& report, const std::string& calibration);

/// World with the board at `instant` as its floor: origin at corner 0, +Y up (towards the cameras), x along
/// the rows.
/// @throws usage Error when the board was not placed at that instant.
Rigidd world_on_board(const BundleResult& result, Index instant);

}  // namespace tactus
