/// MetaImage of ITK (.mha; .mhd beside its voxels), https://itk.org/Wiki/ITK/MetaIO/Documentation.
#include <algorithm>
#include <map>
#include <vector>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/io/label_voxels.h"

namespace tactus {
namespace {

using Fields = std::map<std::string, std::string>;

std::string trimmed(std::string_view s) {
  const std::size_t b = s.find_first_not_of(" \t\r"), e = s.find_last_not_of(" \t\r");
  return b == s.npos ? "" : std::string(s.substr(b, e - b + 1));
}

/// The last field says where the voxels are.
Fields read_header(LabelBytes& file, const std::string& path) {
  Fields fields;
  std::string line;
  while (file.line(line)) {
    if (trimmed(line).empty()) continue;
    const std::size_t equals = line.find('=');
    if (equals == line.npos)
      throw Error(path + ": header line '" + printable(line) + "', expected 'Field = value'");
    const std::string key = trimmed(line.substr(0, equals));
    fields[key] = trimmed(line.substr(equals + 1));
    if (key == "ElementDataFile") return fields;
  }
  throw Error(path + ": the header lacks ElementDataFile");
}

/// The value of the first of these names that is there, or `otherwise`.
std::string field(const Fields& fields, std::initializer_list<const char*> names,
                  const char* otherwise = "") {
  for (const char* name : names) {
    const auto found = fields.find(name);
    if (found != fields.end()) return found->second;
  }
  return otherwise;
}

std::vector<double> numbers(const std::string& path, const char* key, const std::string& text,
                            std::size_t count) {
  std::vector<double> values;
  for (std::size_t b = text.find_first_not_of(" \t"); b != text.npos;) {
    const std::size_t e = std::min(text.find_first_of(" \t", b), text.size());
    values.push_back(header_number(path, key, text.substr(b, e - b)));
    b = text.find_first_not_of(" \t", e);
  }
  if (values.size() != count) refuse_field(path, key, text, std::to_string(count) + " numbers");
  return values;
}

bool is_true(const std::string& path, const char* key, const std::string& value) {
  if (value == "True" || value == "true" || value == "1" || value == "T") return true;
  if (value == "False" || value == "false" || value == "0" || value == "F") return false;
  refuse_field(path, key, value, "True or False");
}

VoxelType type_of(const std::string& path, const std::string& name) {
  static const std::map<std::string, VoxelType> kTypes = {
      {"MET_UCHAR", VoxelType::u8},       {"MET_CHAR", VoxelType::i8},       {"MET_USHORT", VoxelType::u16},
      {"MET_SHORT", VoxelType::i16},      {"MET_UINT", VoxelType::u32},      {"MET_INT", VoxelType::i32},
      {"MET_ULONG_LONG", VoxelType::u64}, {"MET_LONG_LONG", VoxelType::i64}, {"MET_ULONG", VoxelType::u32},
      {"MET_LONG", VoxelType::i32},       {"MET_FLOAT", VoxelType::f32},     {"MET_DOUBLE", VoxelType::f64}};
  const auto found = kTypes.find(name);
  if (found == kTypes.end())
    refuse_field(path, "ElementType", name, "whole or real numbers, such as MET_UCHAR");
  return found->second;
}

/// Its space points to the left, the back and the head; a row of the matrix is the direction of an axis.
void place(const std::string& path, const Fields& fields, VoxelLayout& layout) {
  const std::string spacing = field(fields, {"ElementSpacing", "ElementSize"});
  if (spacing.empty()) throw Error(path + ": the header lacks ElementSpacing, so its voxels have no size");
  const std::vector<double> size = numbers(path, "ElementSpacing", spacing, 3),
                            turn = numbers(path, "TransformMatrix",
                                           field(fields, {"TransformMatrix", "Rotation", "Orientation"},
                                                 "1 0 0 0 1 0 0 0 1"),
                                           9),
                            offset = numbers(path, "Offset",
                                             field(fields, {"Offset", "Position", "Origin"}, "0 0 0"), 3);
  const Vec3d sign{-1, -1, 1};
  for (std::size_t j = 0; j < 3; ++j) {
    const int row = static_cast<int>(j);
    for (std::size_t k = 0; k < 3; ++k) layout.step_mm[k][row] = sign[row] * size[k] * turn[3 * k + j];
    layout.first_mm[row] = sign[row] * offset[j];
  }
}

void check_kind(const std::string& path, const Fields& fields) {
  const auto expect = [&](const char* key, const char* wanted) {
    const std::string value = field(fields, {key}, wanted);
    if (value != wanted) refuse_field(path, key, value, wanted);
  };
  expect("ObjectType", "Image");
  if (field(fields, {"NDims"}) != "3") refuse_field(path, "NDims", field(fields, {"NDims"}), "3");
  expect("ElementNumberOfChannels", "1");
  if (!is_true(path, "BinaryData", field(fields, {"BinaryData"}, "True")))
    refuse_field(path, "BinaryData", "False", "True");
}

}  // namespace

LabelVolume read_meta_image(const std::string& path) {
  LabelBytes header(path);
  const Fields fields = read_header(header, path);
  check_kind(path, fields);
  VoxelLayout layout;
  const std::string dims = field(fields, {"DimSize"});
  const std::vector<double> n = numbers(path, "DimSize", dims, 3);
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(n[k] >= 1 && n[k] <= 1e9)) refuse_field(path, "DimSize", dims, "numbers from 1 on");
    layout.dims[k] = static_cast<std::int64_t>(n[k]);
  }
  check_voxel_count(path, layout);
  layout.type = type_of(path, field(fields, {"ElementType"}));
  layout.big_endian = is_true(path, "BinaryDataByteOrderMSB",
                              field(fields, {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}, "False"));
  place(path, fields, layout);
  const bool packed = is_true(path, "CompressedData", field(fields, {"CompressedData"}, "False"));
  const std::string name = fields.at("ElementDataFile");
  if (name.starts_with("LIST") || name.find('%') != name.npos)
    refuse_field(path, "ElementDataFile", name, "one file, or LOCAL");
  std::unique_ptr<LabelBytes> apart;
  if (name != "LOCAL" && name != "Local" && name != "local")
    apart = std::make_unique<LabelBytes>(named_data_file(path, name), LabelBytes::Packing::none);
  LabelBytes& bytes = apart ? *apart : header;
  const std::string skip = field(fields, {"HeaderSize"}, "0");
  const std::int64_t before = header_integer(path, "HeaderSize", skip);
  if (before < 0 || before > 1000000000) refuse_field(path, "HeaderSize", skip, "0 to 1e9");
  if (apart) bytes.skip(static_cast<std::uint64_t>(before));
  if (packed) bytes.unpack();
  return read_voxels(path, bytes, layout);
}

}  // namespace tactus
