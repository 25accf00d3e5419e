#include "tactus/io/labels/label_voxels.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"

namespace tactus {
namespace {

constexpr std::int64_t kMaxVoxels = (std::int64_t{1} << 31) - 1;

std::size_t size_of(VoxelType type) {
  static constexpr std::size_t kSizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<std::size_t>(type)];
}

template <class T>
double value_of(const unsigned char* p, bool swap) {
  unsigned char bytes[sizeof(T)];
  std::memcpy(bytes, p, sizeof(T));
  if (swap) std::reverse(bytes, bytes + sizeof(T));
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<double>(value);
}

double value_of(VoxelType type, const unsigned char* p, bool swap) {
  switch (type) {
    case VoxelType::u8:
      return value_of<std::uint8_t>(p, swap);
    case VoxelType::i8:
      return value_of<std::int8_t>(p, swap);
    case VoxelType::u16:
      return value_of<std::uint16_t>(p, swap);
    case VoxelType::i16:
      return value_of<std::int16_t>(p, swap);
    case VoxelType::u32:
      return value_of<std::uint32_t>(p, swap);
    case VoxelType::i32:
      return value_of<std::int32_t>(p, swap);
    case VoxelType::u64:
      return value_of<std::uint64_t>(p, swap);
    case VoxelType::i64:
      return value_of<std::int64_t>(p, swap);
    case VoxelType::f32:
      return value_of<float>(p, swap);
    case VoxelType::f64:
      return value_of<double>(p, swap);
  }
  return 0;
}

/// Numbers of a text, with spaces or line ends between them.
class TextNumbers {
 public:
  TextNumbers(const std::string& path, LabelBytes& bytes) : path_(path), bytes_(bytes), block_(1 << 16) {}
  /// False at the end.
  bool next(double& value) {
    constexpr std::size_t kMostDigits = 64;
    std::string word;
    for (char c; take(c);) {
      const bool is_space = c == ' ' || c == '\t' || c == '\r' || c == '\n';
      if (is_space && !word.empty()) break;
      if (!is_space) word += c;
      if (word.size() > kMostDigits) break;
    }
    if (word.empty()) return false;
    value = header_number(path_, "data", word, "numbers, as its encoding says");
    return true;
  }

 private:
  bool take(char& c) {
    if (at_ == end_) {
      end_ = bytes_.read(block_.data(), block_.size());
      at_ = 0;
    }
    if (at_ == end_) return false;
    c = block_[at_++];
    return true;
  }
  const std::string& path_;
  LabelBytes& bytes_;
  std::vector<char> block_;
  std::size_t at_ = 0, end_ = 0;
};

std::string dims_text(const VoxelLayout& v) {
  return std::to_string(v.dims[0]) + " x " + std::to_string(v.dims[1]) + " x " + std::to_string(v.dims[2]);
}

void append_label(const std::string& path, const VoxelLayout& layout, double stored,
                  std::vector<VoxelLabel>& labels) {
  const double value = layout.slope * stored + layout.intercept, label = std::round(value);
  // A thousandth is the rounding of scaled numbers.
  if (!(label >= 0 && label <= kMostLabel && std::abs(value - label) <= 1e-3)) {
    const auto n = static_cast<std::int64_t>(labels.size());
    throw Error(path + ": voxel (" + std::to_string(n % layout.dims[0]) + ", " +
                std::to_string(n / layout.dims[0] % layout.dims[1]) + ", " +
                std::to_string(n / layout.dims[0] / layout.dims[1]) + ") holds " + number_text(value) +
                ", expected labels from 0 to 65535: is it an image and no segmentation?");
  }
  labels.push_back(static_cast<VoxelLabel>(label));
}

void expect_all(const std::string& path, std::size_t there, std::size_t voxels) {
  if (there < voxels)
    throw Error(path + ": truncated, it holds " + std::to_string(there) + " of " + std::to_string(voxels) +
                " voxels");
}

void read_text(const std::string& path, LabelBytes& bytes, const VoxelLayout& layout, std::size_t voxels,
               std::vector<VoxelLabel>& labels) {
  TextNumbers numbers(path, bytes);
  for (double value; labels.size() < voxels && numbers.next(value);)
    append_label(path, layout, value, labels);
  expect_all(path, labels.size(), voxels);
}

void read_binary(const std::string& path, LabelBytes& bytes, const VoxelLayout& layout, std::size_t voxels,
                 std::vector<VoxelLabel>& labels) {
  const std::size_t size = size_of(layout.type);
  // Memory is taken as bytes come: a header may promise more than any file holds.
  std::vector<unsigned char> block(std::min(voxels, (std::size_t{1} << 20)) * size);
  while (labels.size() < voxels) {
    const std::size_t count = std::min(block.size() / size, voxels - labels.size());
    const std::size_t there = bytes.read(block.data(), count * size) / size;
    for (std::size_t i = 0; i < there; ++i)
      append_label(path, layout, value_of(layout.type, block.data() + i * size, layout.big_endian), labels);
    if (there < count) expect_all(path, labels.size(), voxels);
  }
  bytes.read(block.data(), 1);  // reads on to the check sum of compressed data
}

/// Turns the volume's x axis round.
void mirror_x(LabelVolume& volume) {
  for (std::size_t row = 0; row < volume.labels.size(); row += static_cast<std::size_t>(volume.dims.x)) {
    const auto begin = volume.labels.begin() + static_cast<std::ptrdiff_t>(row);
    std::reverse(begin, begin + volume.dims.x);
  }
}

/// Sizes, axes and corner of a volume whose labels are there.
void place(const std::string& path, const VoxelLayout& layout, LabelVolume& volume) {
  constexpr double kMost_mm = 1e6, kSkew = 1e-3;
  Vec3d axis[3], first = layout.first_mm;
  for (int k = 0; k < 3; ++k) {
    const double size = length(layout.step_mm[k]);
    if (!(size > 0 && size <= kMost_mm) || !(length(first) <= kMost_mm))
      throw Error(path + ": voxels of " + number_text(size) + " mm along axis " + std::to_string(k) + ", " +
                  number_text(length(first)) + " mm from the origin, expected lengths above 0 up to 1e6 mm");
    volume.voxel_size_m[k] = static_cast<float>(1e-3 * size);
    for (int j = 0; j < 3; ++j) axis[k][j] = layout.step_mm[k][j] / size;
  }
  const double skew = std::max(
      {std::abs(dot(axis[0], axis[1])), std::abs(dot(axis[1], axis[2])), std::abs(dot(axis[2], axis[0]))});
  if (skew > kSkew)
    throw Error(path + ": its axes are not at right angles (cosine " + number_text(skew) +
                "), expected a volume that is moved and turned only; resample it");
  if (dot(cross(axis[0], axis[1]), axis[2]) < 0) {
    first = first + static_cast<double>(layout.dims[0] - 1) * layout.step_mm[0];
    axis[0] = -1. * axis[0];
    mirror_x(volume);
  }
  // At right angles to the last digit.
  axis[1] = axis[1] - dot(axis[1], axis[0]) * axis[0];
  axis[1] = (1 / length(axis[1])) * axis[1];
  axis[2] = cross(axis[0], axis[1]);
  Vec3d corner;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) volume.R_body_volume(j, k) = axis[k][j];
    corner[k] = dot(axis[k], first) - 0.5 * length(layout.step_mm[k]);
  }
  volume.origin_m = vec_cast<float>(1e-3 * corner);
}

}  // namespace

void VoxelLayout::place_at_corner(Vec3d size_mm) {
  for (int k = 0; k < 3; ++k) {
    step_mm[k] = {};
    step_mm[k][k] = size_mm[k];
  }
  first_mm = 0.5 * size_mm;
}

void check_voxel_count(const std::string& path, const VoxelLayout& layout) {
  std::int64_t voxels = 1;
  for (const std::int64_t n : layout.dims) {
    if (n < 1) throw Error(path + ": " + dims_text(layout) + " voxels, expected 1 or more along each axis");
    if (n > kMaxVoxels / voxels)
      throw Error(path + ": " + dims_text(layout) + " voxels are too many, expected fewer than 2^31");
    voxels *= n;
  }
}

LabelVolume read_voxels(const std::string& path, LabelBytes& bytes, const VoxelLayout& layout) {
  check_voxel_count(path, layout);
  LabelVolume volume;
  for (int k = 0; k < 3; ++k) volume.dims[k] = static_cast<Index>(layout.dims[k]);
  const auto voxels = static_cast<std::size_t>(layout.dims[0] * layout.dims[1] * layout.dims[2]);
  (layout.is_text ? read_text : read_binary)(path, bytes, layout, voxels, volume.labels);
  place(path, layout, volume);
  return volume;
}

void refuse_field(const std::string& path, std::string_view field, std::string_view value,
                  const std::string& expected) {
  throw Error(path + ": header field " + std::string(field) + "=" + printable(std::string(value)) +
              ", expected " + expected);
}

double header_number(const std::string& path, std::string_view field, std::string_view word,
                     const char* expected) {
  std::string_view s = word;
  if (s.size() > 1 && s.front() == '+') s.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  if (error != std::errc{} || end != s.data() + s.size() || !std::isfinite(value))
    refuse_field(path, field, word, expected);
  return value;
}

std::int64_t header_integer(const std::string& path, std::string_view field, std::string_view word) {
  const double value = header_number(path, field, word, "a whole number");
  if (value != std::floor(value) || std::abs(value) > 1e15) refuse_field(path, field, word, "a whole number");
  return static_cast<std::int64_t>(value);
}

}  // namespace tactus
