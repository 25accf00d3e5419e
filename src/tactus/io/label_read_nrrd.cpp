/// NRRD (.nrrd, .seg.nrrd, .nhdr), https://teem.sourceforge.net/nrrd/format.html.
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
  const std::size_t b = s.find_first_not_of(" \t"), e = s.find_last_not_of(" \t");
  return b == s.npos ? "" : std::string(s.substr(b, e - b + 1));
}

std::string lower(std::string s) {
  std::transform(s.begin(), s.end(), s.begin(), [](unsigned char c) { return std::tolower(c); });
  return s;
}

/// Fields up to the empty line; in a detached header up to its end.
Fields read_header(LabelBytes& file, const std::string& path) {
  Fields fields;
  std::string line;
  file.line(line);  // the magic
  while (file.line(line) && !line.empty()) {
    if (line[0] == '#' || line.find(":=") != line.npos) continue;  // comments, and what programs note
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

std::string field(const Fields& fields, const std::string& key) {
  const auto found = fields.find(key);
  return found == fields.end() ? "" : found->second;
}

std::vector<std::string> words_of(const std::string& text, const std::string& separators) {
  std::vector<std::string> words;
  for (std::size_t b = text.find_first_not_of(separators); b != text.npos;) {
    const std::size_t e = std::min(text.find_first_of(separators, b), text.size());
    words.push_back(text.substr(b, e - b));
    b = text.find_first_not_of(separators, e);
  }
  return words;
}

/// So many numbers of a field.
std::vector<double> numbers(const std::string& path, const std::string& key, const std::string& text,
                            std::size_t count) {
  std::vector<double> values;
  for (const std::string& word : words_of(text, " \t(),")) values.push_back(header_number(path, key, word));
  if (values.size() != count) refuse_field(path, key, text, std::to_string(count) + " numbers");
  return values;
}

VoxelType type_of(const std::string& path, const std::string& name) {
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
  const auto found = kTypes.find(name);
  if (found == kTypes.end()) refuse_field(path, "type", name, "whole or real numbers, such as uchar");
  return found->second;
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

void place(const std::string& path, const Fields& fields, VoxelLayout& layout) {
  const std::string directions = field(fields, "spacedirections");
  if (directions.empty()) {
    if (field(fields, "spacings").empty())
      throw Error(path + ": the header lacks 'space directions' and 'spacings', so its voxels have no size");
    const std::vector<double> size = numbers(path, "spacings", field(fields, "spacings"), 3);
    return layout.place_at_corner({size[0], size[1], size[2]});
  }
  const double unit = unit_mm(path, field(fields, "spaceunits"));
  const Vec3d sign = signs_of_space(path, field(fields, "space"));
  const std::vector<double> d = numbers(path, "space directions", directions, 9);
  const std::string origin = field(fields, "spaceorigin");
  const std::vector<double> o = numbers(path, "space origin", origin.empty() ? "0 0 0" : origin, 3);
  for (int j = 0; j < 3; ++j) {
    for (int k = 0; k < 3; ++k)
      layout.step_mm[k][j] = unit * sign[j] * d[static_cast<std::size_t>(3 * k + j)];
    layout.first_mm[j] = unit * sign[j] * o[static_cast<std::size_t>(j)];
  }
}

std::uint64_t skipped(const std::string& path, const Fields& fields, const std::string& key) {
  const std::string word = field(fields, key);
  if (word.empty()) return 0;
  const std::int64_t n = header_integer(path, key, word);
  if (n < 0 || n > 1000000000) refuse_field(path, key, word, "0 to 1e9");
  return static_cast<std::uint64_t>(n);
}

}  // namespace

LabelVolume read_nrrd(const std::string& path) {
  LabelBytes header(path);
  const Fields fields = read_header(header, path);
  const std::string dimension = field(fields, "dimension");
  if (dimension != "3")
    refuse_field(path, "dimension", dimension,
                 "3; where segments overlap, 3D Slicer writes a list of volumes: export them as a label map");
  VoxelLayout layout;
  const std::vector<double> sizes = numbers(path, "sizes", field(fields, "sizes"), 3);
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(sizes[k] >= 1 && sizes[k] <= 1e9))
      refuse_field(path, "sizes", field(fields, "sizes"), "numbers from 1 on");
    layout.dims[k] = static_cast<std::int64_t>(sizes[k]);
  }
  check_voxel_count(path, layout);
  layout.type = type_of(path, field(fields, "type"));
  const std::string endian = field(fields, "endian");
  if (!endian.empty() && endian != "little" && endian != "big")
    refuse_field(path, "endian", endian, "little or big");
  layout.big_endian = endian == "big";
  place(path, fields, layout);
  const std::string encoding = field(fields, "encoding");
  const bool packed = encoding == "gzip" || encoding == "gz";
  if (!packed && encoding != "raw") refuse_field(path, "encoding", encoding, "raw or gzip");
  const std::string data_file = field(fields, "datafile");
  std::unique_ptr<LabelBytes> apart;
  if (!data_file.empty())
    apart = std::make_unique<LabelBytes>(named_data_file(path, data_file), LabelBytes::Packing::none);
  LabelBytes& bytes = apart ? *apart : header;
  std::string line;
  for (std::uint64_t n = skipped(path, fields, "lineskip"); n > 0 && bytes.line(line); --n) continue;
  if (packed) bytes.unpack();
  bytes.skip(skipped(path, fields, "byteskip"));
  return read_voxels(path, bytes, layout);
}

}  // namespace tactus
