#pragma once
/// Types and functions that the readers of label volumes share. Internal to io.
#include <string>
#include <string_view>

#include "tactus/base/vec.h"
#include "tactus/geom/lattice/label_volume.h"
#include "tactus/io/labels/label_bytes.h"

namespace tactus {

enum class VoxelType : std::uint8_t { u8, i8, u16, i16, u32, i32, u64, i64, f32, f64 };

/// Places of a file's voxels, and the type of their values.
struct VoxelLayout {
  std::int64_t dims[3] = {1, 1, 1};
  VoxelType type = VoxelType::u8;
  bool big_endian = false;
  bool is_text = false;             ///< numbers are written out, whatever their type
  double slope = 1, intercept = 0;  ///< a label is slope * number + intercept
  /// In millimetres: the way from one voxel to the next along each of the file's axes, and the centre of the
  /// first. x points to the patient's right, y to the front, z to the head.
  Vec3d step_mm[3];
  Vec3d first_mm;

  /// No more is known than the voxels' sizes: axes are x, y and z, and the volume's lowest corner is the
  /// origin.
  void place_at_corner(Vec3d size_mm);
};

/// @throws Error naming the file and the sizes: 0, or 2^31 voxels and more.
void check_voxel_count(const std::string& path, const VoxelLayout& layout);

/// Reads the voxels. Memory is taken as they come. Volumes that are turned keep their turn; mirrored ones are
/// mirrored back.
/// @throws Error naming the file, the voxel and its value: truncated, no label from 0 to 65535, axes that are
/// no lengths or not at right angles.
LabelVolume read_voxels(const std::string& path, LabelBytes& bytes, const VoxelLayout& layout);

/// A number of a header field. @throws Error naming the file, the field, its value and `expected`.
double header_number(const std::string& path, std::string_view field, std::string_view word,
                     const char* expected = "a number");
std::int64_t header_integer(const std::string& path, std::string_view field, std::string_view word);
[[noreturn]] void refuse_field(const std::string& path, std::string_view field, std::string_view value,
                               const std::string& expected);

LabelVolume read_inr(const std::string& path);
LabelVolume read_nifti(const std::string& path);
LabelVolume read_nrrd(const std::string& path);
LabelVolume read_meta_image(const std::string& path);

}  // namespace tactus
