/// INRIMAGE-4: one unsigned byte a voxel.
#include <map>

#include "tactus/base/error.h"
#include "tactus/io/labels/label_voxels.h"

namespace tactus {
namespace {

using Fields = std::map<std::string, std::string>;

constexpr std::size_t kHeaderBytes = 256;  // headers are padded to a multiple of this
constexpr std::size_t kMaxInrHeaderBytes = 64 * kHeaderBytes;

Fields read_inr_header(LabelBytes& file, const std::string& path) {
  std::string header;
  while (header.find("##}") == std::string::npos) {
    char block[kHeaderBytes];
    const bool full = file.read(block, sizeof block) == sizeof block;
    header.append(block, full ? sizeof block : 0);
    if (!full || header.size() > kMaxInrHeaderBytes) throw Error(path + ": the header has no end ('##}')");
  }
  Fields fields;
  std::size_t begin = header.find('\n');
  while (begin != std::string::npos) {
    const std::size_t end = header.find('\n', begin + 1);
    const std::string line = header.substr(begin + 1, end == std::string::npos ? end : end - begin - 1);
    if (const std::size_t equals = line.find('='); equals != std::string::npos)
      fields[line.substr(0, equals)] = line.substr(equals + 1);
    begin = end;
  }
  return fields;
}

const std::string& field(const Fields& fields, const std::string& key, const std::string& path) {
  const auto found = fields.find(key);
  if (found == fields.end()) throw Error(path + ": the header lacks " + key);
  return found->second;
}

double above_0(const Fields& fields, const std::string& key, const std::string& path) {
  const std::string& word = field(fields, key, path);
  const double value = header_number(path, key, word, "a number above 0");
  if (!(value > 0)) refuse_field(path, key, word, "a number above 0");
  return value;
}

void expect_field(const Fields& fields, const std::string& key, const std::string& expected,
                  const std::string& path) {
  const auto found = fields.find(key);
  const std::string value = found == fields.end() ? "" : found->second;
  if (value != expected) refuse_field(path, key, value, expected + " (labels are one unsigned byte a voxel)");
}

}  // namespace

LabelVolume read_inr(const std::string& path) {
  LabelBytes file(path);
  const Fields fields = read_inr_header(file, path);
  expect_field(fields, "VDIM", "1", path);
  expect_field(fields, "TYPE", "unsigned fixed", path);
  expect_field(fields, "PIXSIZE", "8 bits", path);
  VoxelLayout layout;
  Vec3d size_mm;
  const char* const dims[] = {"XDIM", "YDIM", "ZDIM"};
  const char* const sizes[] = {"VX", "VY", "VZ"};
  for (int i = 0; i < 3; ++i) {
    layout.dims[i] = header_integer(path, dims[i], field(fields, dims[i], path));
    if (layout.dims[i] < 1) refuse_field(path, dims[i], fields.at(dims[i]), "a number above 0");
    size_mm[i] = above_0(fields, sizes[i], path);
  }
  layout.place_at_corner(size_mm);
  return read_voxels(path, file, layout);
}

}  // namespace tactus
