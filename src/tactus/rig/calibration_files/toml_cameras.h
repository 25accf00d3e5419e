#pragma once
/// Tables of cameras in TOML, as caliscope, anipose, FreeMoCap and Pose2Sim all have them. World to camera.
#include "tactus/rig/calibration_files/formats.h"

namespace tactus::calibration {

/// The tables at the root, and in `cameras`, that have a matrix.
std::vector<const DataNode*> camera_tables(const DataNode& root);
FileCamera read_camera_table(const DataNode& table, const char* format, double unit_m,
                             const CalibrationAnswers& answers);

}  // namespace tactus::calibration
