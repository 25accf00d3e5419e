/// NIfTI-1 and NIfTI-2 in one file (.nii, .nii.gz), https://nifti.nimh.nih.gov/nifti-1.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "tactus/base/error.h"
#include "tactus/io/labels/label_voxels.h"

namespace tactus {
namespace {

/// The fields of both versions by their place in bytes.
struct Places {
  std::size_t size, magic, dims, type, pixdim, offset, slope, qform, sform, quaternion, quaternion_offset,
      srow, units;
};
constexpr Places kFirst = {348, 344, 40, 70, 76, 108, 112, 252, 254, 256, 268, 280, 123};
constexpr Places kSecond = {540, 4, 16, 12, 104, 168, 176, 344, 348, 352, 376, 400, 500};

class Header {
 public:
  Header(const std::string& path, LabelBytes& file) {
    const std::size_t there = file.read(bytes_, kFirst.size);
    swaps_ = there < 4 || number<std::int32_t>(0) < 0 || number<std::int32_t>(0) > 0xffff;
    const auto size = there < 4 ? 0 : number<std::int32_t>(0);
    second_ = size == static_cast<std::int32_t>(kSecond.size);
    const bool whole = there == kFirst.size &&
                       (!second_ || file.read(bytes_ + there, kSecond.size - there) == kSecond.size - there);
    if (!whole) throw Error(path + ": truncated in its header of " + std::to_string(size) + " bytes");
    const char* const magic = bytes_ + at().magic;
    if (std::memcmp(magic, "ni", 2) == 0)
      throw Error(path + ": its voxels are in another file (.img), expected one file, .nii or .nii.gz");
    if (std::memcmp(magic, "n+", 2) != 0)
      throw Error(path +
                  ": a header of Analyze 7.5, which says no orientation; expected NIfTI (.nii, .nii.gz)");
  }
  const Places& at() const { return second_ ? kSecond : kFirst; }
  bool big_endian() const { return swaps_; }
  /// An integer of 16 bits in the first version, of 64 or 32 in the second.
  std::int64_t dim(std::size_t i) const {
    return second_ ? number<std::int64_t>(at().dims + 8 * i) : number<std::int16_t>(at().dims + 2 * i);
  }
  std::int64_t type() const { return number<std::int16_t>(at().type); }
  std::int64_t code(std::size_t place) const {
    return second_ ? number<std::int32_t>(place) : number<std::int16_t>(place);
  }
  double offset() const {
    return second_ ? static_cast<double>(number<std::int64_t>(at().offset)) : real(at().offset, 0);
  }
  /// Number i of an array that begins there.
  double real(std::size_t place, std::size_t i) const {
    return second_ ? number<double>(place + 8 * i) : static_cast<double>(number<float>(place + 4 * i));
  }
  double unit_mm() const {
    const auto code = (second_ ? number<std::int32_t>(at().units) : bytes_[at().units]) & 7;
    return code == 1 ? 1000 : (code == 3 ? 1e-3 : 1);
  }

 private:
  template <class T>
  T number(std::size_t place) const {
    char bytes[sizeof(T)];
    std::memcpy(bytes, bytes_ + place, sizeof(T));
    if (swaps_) std::reverse(bytes, bytes + sizeof(T));
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
  }
  bool swaps_ = false, second_ = false;
  char bytes_[kSecond.size] = {};
};

VoxelType type_of(const std::string& path, std::int64_t code) {
  static constexpr std::pair<std::int64_t, VoxelType> kTypes[] = {
      {2, VoxelType::u8},     {4, VoxelType::i16},   {8, VoxelType::i32},   {16, VoxelType::f32},
      {64, VoxelType::f64},   {256, VoxelType::i8},  {512, VoxelType::u16}, {768, VoxelType::u32},
      {1024, VoxelType::i64}, {1280, VoxelType::u64}};
  for (const auto& [c, type] : kTypes) {
    if (c == code) return type;
  }
  refuse_field(path, "datatype", std::to_string(code), "whole or real numbers, such as 2 (unsigned bytes)");
}

void read_dims(const std::string& path, const Header& header, VoxelLayout& layout) {
  const std::int64_t count = header.dim(0);
  if (count < 1 || count > 7) refuse_field(path, "dim[0]", std::to_string(count), "3");
  for (std::int64_t i = 1; i <= count; ++i) {
    const std::int64_t n = header.dim(static_cast<std::size_t>(i));
    if (i <= 3) layout.dims[i - 1] = n;
    if (i > 3 && n > 1)
      throw Error(path + ": it has " + std::to_string(n) + " volumes along axis " + std::to_string(i) +
                  " (dim[0]=" + std::to_string(count) + "), expected one volume of labels");
  }
}

/// From the quaternion (a, b, c, d). The file holds b, c and d; a = sqrt(1 - b^2 - c^2 - d^2).
void place_by_quaternion(const Header& header, double unit, VoxelLayout& layout) {
  const Places& at = header.at();
  double b = header.real(at.quaternion, 0), c = header.real(at.quaternion, 1),
         d = header.real(at.quaternion, 2);
  const double squares = b * b + c * c + d * d, norm = squares > 1 ? 1 / std::sqrt(squares) : 1;
  const double a = squares > 1 ? 0 : std::sqrt(1 - squares);
  b *= norm, c *= norm, d *= norm;
  const Vec3d axis[3] = {{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)},
                         {2 * (b * c - a * d), a * a + c * c - b * b - d * d, 2 * (c * d + a * b)},
                         {2 * (b * d + a * c), 2 * (c * d - a * b), a * a + d * d - b * b - c * c}};
  for (std::size_t k = 0; k < 3; ++k) {
    const double flip = k == 2 && header.real(at.pixdim, 0) < 0 ? -1 : 1;
    layout.step_mm[k] = (flip * unit * std::abs(header.real(at.pixdim, k + 1))) * axis[k];
    layout.first_mm[static_cast<int>(k)] = unit * header.real(at.quaternion_offset, k);
  }
}

void place(const Header& header, VoxelLayout& layout) {
  const Places& at = header.at();
  const double unit = header.unit_mm();
  if (header.code(at.sform) > 0) {
    for (std::size_t row = 0; row < 3; ++row) {
      for (std::size_t k = 0; k < 3; ++k)
        layout.step_mm[k][static_cast<int>(row)] = unit * header.real(at.srow, 4 * row + k);
      layout.first_mm[static_cast<int>(row)] = unit * header.real(at.srow, 4 * row + 3);
    }
  } else if (header.code(at.qform) > 0) {
    place_by_quaternion(header, unit, layout);
  } else {
    const auto size = [&](std::size_t k) { return unit * std::abs(header.real(at.pixdim, k)); };
    layout.place_at_corner({size(1), size(2), size(3)});
  }
}

}  // namespace

LabelVolume read_nifti(const std::string& path) {
  LabelBytes file(path);
  const Header header(path, file);
  VoxelLayout layout;
  layout.type = type_of(path, header.type());
  layout.big_endian = header.big_endian();
  read_dims(path, header, layout);
  check_voxel_count(path, layout);
  place(header, layout);
  const double slope = header.real(header.at().slope, 0), intercept = header.real(header.at().slope, 1);
  if (std::isfinite(slope) && slope != 0) {  // 0: numbers are as they are
    layout.slope = slope;
    layout.intercept = std::isfinite(intercept) ? intercept : 0;
  }
  const auto read = static_cast<double>(header.at().size);
  const double offset = header.offset();
  if (!(offset >= read && offset <= 1e9))
    refuse_field(path, "vox_offset", number_text(offset), "352 or more");
  file.skip(static_cast<std::uint64_t>(offset - read));
  return read_voxels(path, file, layout);
}

}  // namespace tactus
