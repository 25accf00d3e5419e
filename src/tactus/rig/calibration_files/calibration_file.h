#pragma once
/// Calibrations of any tool, to and from the project's conventions: world points to camera points, x right, y
/// down, z forward, pixel centres at whole numbers, metres. Each format is one file and one row of
/// `calibration_formats()`.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/geom/camera/lens.h"

namespace tactus {

/// Names of the nodes of an OpenCV file, where they are none of the usual ones.
struct CalibrationNodes {
  std::string intrinsics, distortion, rotation, translation;  ///< "": the usual ones
};

/// Answers to the questions that a format may leave open: they are asked for, never guessed.
struct CalibrationAnswers {
  std::optional<double> unit_m;        ///< metres per unit of length of the file
  std::optional<Vec2i> image_size_px;  ///< of every camera whose size the file doesn't say
  std::optional<LensModel> lens;       ///< meaning of coefficients where the file doesn't say it; none: brown
  std::string format;                  ///< a name of the table, where content does not decide; "": by content
  CalibrationNodes nodes;
  /// How the asker spells the questions, for messages: flags or keys.
  std::string unit_name = "--unit-m", size_name = "--image-size", format_name = "--format";
};

/// One camera of a file.
struct FileCamera {
  CalibratedCamera calibrated;  ///< named; metres
  bool has_pose = true;         ///< false: a lens alone, the pose is the identity
};

struct CalibrationData {
  std::string format;
  std::vector<FileCamera> cameras;  ///< in the order of the file
};

/// Reads a file, or the folder where a format has several files.
/// @throws Error naming file, line or key: missing, of no known format, damaged, no camera; usage Error for a
/// question that the format leaves open and `answers` does not answer, or answers otherwise than the file.
CalibrationData read_calibration_file(const std::string& path, const CalibrationAnswers& answers = {});

/// The camera of this name; of a file with one camera that one, by any name.
/// @throws Error naming the file, the names there are and the nearest; or when it has no pose.
const FileCamera& camera_of(const CalibrationData& data, const std::string& name, const std::string& path);

/// Writes all cameras. @throws usage Error: the format is unknown or only read (names those that are
/// written), or it can not say a lens or a skew that a camera has. @throws Error: the file can't be written.
void write_calibration_file(const std::string& path, const std::string& format,
                            std::span<const FileCamera> cameras);

/// @throws usage Error as write_calibration_file for a format that can't be written.
void check_written_format(const std::string& format);

/// Description of a format, for help and documents.
struct CalibrationFormatInfo {
  std::string name, of;  ///< "kalibr", "Kalibr camchain YAML (...)"
  bool written;
  std::string asks;  ///< questions that the file leaves open: "unit", "unit, image size", ""
};
std::vector<CalibrationFormatInfo> calibration_formats();

/// Abilities that this build lacks for want of a library, a sentence each, with the Debian package; empty
/// when all are there.
std::vector<std::string> missing_parts();

}  // namespace tactus
