#pragma once
/// Files as strings, bounded before anything is allocated.
#include <cstdint>
#include <string>

namespace tactus {

enum class ReadFrom : std::uint8_t {
  anything,      ///< for paths that the user names: a pipe or `/dev/stdin` may be meant
  regular_file,  ///< for paths in another file: a FIFO or a device would block or never end
};

/// Whole contents of a file. @throws Error naming the path and the reason: missing, a folder, not a regular
/// file where one is asked for, more than `max_bytes`.
std::string read_file(const std::string& path, std::uint64_t max_bytes, ReadFrom from = ReadFrom::anything);

/// A text file as UTF-8: the byte order mark that editors of Windows begin it with goes, and UTF-16 behind
/// one is converted. Other bytes stay as they are. @throws Error as read_file.
std::string read_text(const std::string& path, std::uint64_t max_bytes, ReadFrom from = ReadFrom::anything);

/// Size limit of files that people write by hand: scenes, rigs.
constexpr std::uint64_t kMaxYamlBytes = std::uint64_t{1} << 20;
/// Size limit of calibrations: OpenCV's programs write all corners of all pictures into them.
constexpr std::uint64_t kMaxCalibrationBytes = std::uint64_t{1} << 25;
/// Size limit of a mesh and of an image file.
constexpr std::uint64_t kMaxMeshBytes = std::uint64_t{1} << 32, kMaxImageBytes = std::uint64_t{1} << 30;

}  // namespace tactus
