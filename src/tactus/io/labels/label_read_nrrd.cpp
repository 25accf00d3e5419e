/// NRRD (.nrrd, .seg.nrrd, .nhdr), https://teem.sourceforge.net/nrrd/format.html.
#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/io/labels/label_header.h"

namespace tactus {
namespace {

constexpr const char* kVectors = " \t(),";  ///< "(1,0,0) (0,1,0) (0,0,1)"

std::string lower(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return std::tolower(c); });
  return s;
}

/// Fields up to the empty line; in a detached header up to its end.
HeaderFields read_nrrd_header(LabelBytes& file, const std::string& path) {
  HeaderFields fields;
  std::string line;
  file.line(line);  // the magic
  while (file.line(line) && !line.empty()) {
    if (line[0] == '#' || line.find(":=") != line.npos) continue;  // comments, and notes of programs
    const std::size_t colon = line.find(": ");
    if (colon == line.npos)
      throw Error(path + ": header line '" + printable(line) + "', expected 'field: value'");
    std::string key = lower(trimmed(line.substr(0, colon)));
    key.erase(std::remove(key.begin(), key.end(), ' '),
              key.end());  // "data file" and "datafile" are the same
    fields[key] = trimmed(line.substr(colon + 2));
  }
  return fields;
}

std::string field(const HeaderFields& fields, const std::string& key) {
  const auto found = fields.find(key);
  return found == fields.end() ? "" : found->second;
}

VoxelType nrrd_type_of(const std::string& path, const std::string& name) {
  static const std::map<std::string, VoxelType> kTypes = {{"uchar", VoxelType::u8},
                                                          {"unsigned char", VoxelType::u8},
                                                          {"uint8", VoxelType::u8},
                                                          {"uint8_t", VoxelType::u8},
                                                          {"signed char", VoxelType::i8},
                                                          {"int8", VoxelType::i8},
                                                          {"int8_t", VoxelType::i8},
                                                          {"ushort", VoxelType::u16},
                                                          {"unsigned short", VoxelType::u16},
                                                          {"uint16", VoxelType::u16},
                                                          {"uint16_t", VoxelType::u16},
                                                          {"unsigned short int", VoxelType::u16},
                                                          {"short", VoxelType::i16},
                                                          {"short int", VoxelType::i16},
                                                          {"signed short", VoxelType::i16},
                                                          {"int16", VoxelType::i16},
                                                          {"int16_t", VoxelType::i16},
                                                          {"signed short int", VoxelType::i16},
                                                          {"uint", VoxelType::u32},
                                                          {"unsigned int", VoxelType::u32},
                                                          {"uint32", VoxelType::u32},
                                                          {"uint32_t", VoxelType::u32},
                                                          {"int", VoxelType::i32},
                                                          {"signed int", VoxelType::i32},
                                                          {"int32", VoxelType::i32},
                                                          {"int32_t", VoxelType::i32},
                                                          {"ulonglong", VoxelType::u64},
                                                          {"uint64", VoxelType::u64},
                                                          {"uint64_t", VoxelType::u64},
                                                          {"unsigned long long", VoxelType::u64},
                                                          {"longlong", VoxelType::i64},
                                                          {"int64", VoxelType::i64},
                                                          {"int64_t", VoxelType::i64},
                                                          {"long long", VoxelType::i64},
                                                          {"unsigned long long int", VoxelType::u64},
                                                          {"long long int", VoxelType::i64},
                                                          {"float", VoxelType::f32},
                                                          {"double", VoxelType::f64}};
  return voxel_type(path, "type", name, kTypes, "uchar");
}

/// Which way the axes of the file's space point, seen from right, front and head.
Vec3d signs_of_space(const std::string& path, const std::string& name) {
  const std::string space = lower(name);
  if (space.empty() || space == "right-anterior-superior" || space == "ras" || space == "3d-right-handed")
    return {1, 1, 1};
  if (space == "left-posterior-superior" || space == "lps") return {-1, -1, 1};
  if (space == "left-anterior-superior" || space == "las") return {-1, 1, 1};
  refuse_field(path, "space", name,
               "left-posterior-superior, right-anterior-superior or left-anterior-superior");
}

double unit_mm(const std::string& path, const std::string& units) {
  if (units.empty() || units.find("\"mm\"") != units.npos) return 1;
  if (units.find("\"m\"") != units.npos) return 1000;
  if (units.find("\"um\"") != units.npos) return 1e-3;
  refuse_field(path, "space units", units, "\"mm\"");
}

void place_nrrd(const std::string& path, const HeaderFields& fields, VoxelLayout& layout) {
  const std::string directions = field(fields, "spacedirections");
  if (directions.empty()) {
    if (field(fields, "spacings").empty())
      throw Error(path + ": the header lacks 'space directions' and 'spacings', so its voxels have no size");
    const std::vector<double> size = header_numbers(path, "spacings", field(fields, "spacings"), 3);
    return layout.place_at_corner({size[0], size[1], size[2]});
  }
  const double unit = unit_mm(path, field(fields, "spaceunits"));
  const Vec3d sign = signs_of_space(path, field(fields, "space"));
  const std::vector<double> d = header_numbers(path, "space directions", directions, 9, kVectors);
  const std::string origin = field(fields, "spaceorigin");
  const std::vector<double> o =
      header_numbers(path, "space origin", origin.empty() ? "0 0 0" : origin, 3, kVectors);
  for (int j = 0; j < 3; ++j) {
    for (int k = 0; k < 3; ++k)
      layout.step_mm[k][j] = unit * sign[j] * d[static_cast<std::size_t>(3 * k + j)];
    layout.first_mm[j] = unit * sign[j] * o[static_cast<std::size_t>(j)];
  }
}

}  // namespace

LabelVolume read_nrrd(const std::string& path) {
  LabelBytes header(path);
  const HeaderFields fields = read_nrrd_header(header, path);
  const std::string dimension = field(fields, "dimension");
  if (dimension != "3")
    refuse_field(path, "dimension", dimension,
                 "3; where segments overlap, 3D Slicer writes a list of volumes: export them as a label map");
  VoxelLayout layout;
  read_sizes(path, "sizes", field(fields, "sizes"), layout);
  layout.type = nrrd_type_of(path, field(fields, "type"));
  const std::string endian = lower(field(fields, "endian"));
  if (!endian.empty() && endian != "little" && endian != "big")
    refuse_field(path, "endian", endian, "little or big");
  layout.big_endian = endian == "big";
  place_nrrd(path, fields, layout);
  const std::string encoding = lower(field(fields, "encoding"));
  const bool packed = encoding == "gzip" || encoding == "gz";
  layout.is_text = encoding == "ascii" || encoding == "text" || encoding == "txt";
  if (!packed && !layout.is_text && encoding != "raw")
    refuse_field(path, "encoding", encoding, "raw, gzip or ascii");
  const std::string data_file = field(fields, "datafile");
  std::unique_ptr<LabelBytes> apart;
  if (!data_file.empty()) apart = data_apart(path, data_file);
  LabelBytes& bytes = apart ? *apart : header;
  std::string line;
  for (std::uint64_t n = header_skip(path, "lineskip", field(fields, "lineskip")); n > 0 && bytes.line(line);
       --n)
    continue;
  if (packed) bytes.unpack();
  bytes.skip(header_skip(path, "byteskip", field(fields, "byteskip")));
  return read_voxels(path, bytes, layout);
}

}  // namespace tactus
