/// MetaImage of ITK (.mha; .mhd beside its voxels), https://itk.org/Wiki/ITK/MetaIO/Documentation.
#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/io/labels/label_header.h"

namespace tactus {
namespace {

/// The last field says where the voxels are.
HeaderFields read_meta_header(LabelBytes& file, const std::string& path) {
  HeaderFields fields;
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
std::string field(const HeaderFields& fields, std::initializer_list<const char*> names,
                  const char* otherwise = "") {
  for (const char* name : names) {
    const auto found = fields.find(name);
    if (found != fields.end()) return found->second;
  }
  return otherwise;
}

bool is_true(const std::string& path, const char* key, const std::string& value) {
  if (value == "True" || value == "true" || value == "1" || value == "T") return true;
  if (value == "False" || value == "false" || value == "0" || value == "F") return false;
  refuse_field(path, key, value, "True or False");
}

VoxelType meta_type_of(const std::string& path, const std::string& name) {
  static const std::map<std::string, VoxelType> kTypes = {
      {"MET_UCHAR", VoxelType::u8},       {"MET_CHAR", VoxelType::i8},       {"MET_USHORT", VoxelType::u16},
      {"MET_SHORT", VoxelType::i16},      {"MET_UINT", VoxelType::u32},      {"MET_INT", VoxelType::i32},
      {"MET_ULONG_LONG", VoxelType::u64}, {"MET_LONG_LONG", VoxelType::i64}, {"MET_ULONG", VoxelType::u32},
      {"MET_LONG", VoxelType::i32},       {"MET_FLOAT", VoxelType::f32},     {"MET_DOUBLE", VoxelType::f64}};
  return voxel_type(path, "ElementType", name, kTypes, "MET_UCHAR");
}

/// Its space points to the left, the back and the head; a row of the matrix is the direction of an axis.
void place_meta(const std::string& path, const HeaderFields& fields, VoxelLayout& layout) {
  const std::string spacing = field(fields, {"ElementSpacing", "ElementSize"});
  if (spacing.empty()) throw Error(path + ": the header lacks ElementSpacing, so its voxels have no size");
  const std::vector<double> size = header_numbers(path, "ElementSpacing", spacing, 3),
                            turn =
                                header_numbers(path, "TransformMatrix",
                                               field(fields, {"TransformMatrix", "Rotation", "Orientation"},
                                                     "1 0 0 0 1 0 0 0 1"),
                                               9),
                            offset = header_numbers(
                                path, "Offset", field(fields, {"Offset", "Position", "Origin"}, "0 0 0"), 3);
  const Vec3d sign{-1, -1, 1};
  for (std::size_t j = 0; j < 3; ++j) {
    const int row = static_cast<int>(j);
    for (std::size_t k = 0; k < 3; ++k) layout.step_mm[k][row] = sign[row] * size[k] * turn[3 * k + j];
    layout.first_mm[row] = sign[row] * offset[j];
  }
}

void check_kind(const std::string& path, const HeaderFields& fields) {
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
  const HeaderFields fields = read_meta_header(header, path);
  check_kind(path, fields);
  VoxelLayout layout;
  read_sizes(path, "DimSize", field(fields, {"DimSize"}), layout);
  layout.type = meta_type_of(path, field(fields, {"ElementType"}));
  layout.big_endian = is_true(path, "BinaryDataByteOrderMSB",
                              field(fields, {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}, "False"));
  place_meta(path, fields, layout);
  const bool packed = is_true(path, "CompressedData", field(fields, {"CompressedData"}, "False"));
  const std::string name = fields.at("ElementDataFile");
  if (name.starts_with("LIST") || name.find('%') != name.npos)
    refuse_field(path, "ElementDataFile", name, "one file, or LOCAL");
  std::unique_ptr<LabelBytes> apart;
  if (name != "LOCAL" && name != "Local" && name != "local") apart = data_apart(path, name);
  LabelBytes& bytes = apart ? *apart : header;
  const std::uint64_t skip = header_skip(path, "HeaderSize", field(fields, {"HeaderSize"}));
  if (apart) bytes.skip(skip);
  if (packed) bytes.unpack();
  return read_voxels(path, bytes, layout);
}

}  // namespace tactus
