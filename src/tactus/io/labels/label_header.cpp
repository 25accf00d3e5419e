#include "tactus/io/labels/label_header.h"

#include <algorithm>

namespace tactus {

std::string trimmed(std::string_view text) {
  const std::size_t b = text.find_first_not_of(" \t\r"), e = text.find_last_not_of(" \t\r");
  return b == text.npos ? "" : std::string(text.substr(b, e - b + 1));
}

std::vector<double> header_numbers(const std::string& path, const std::string& field, const std::string& text,
                                   std::size_t count, const char* separators) {
  std::vector<double> values;
  for (std::size_t b = text.find_first_not_of(separators); b != text.npos;) {
    const std::size_t e = std::min(text.find_first_of(separators, b), text.size());
    values.push_back(header_number(path, field, text.substr(b, e - b)));
    b = text.find_first_not_of(separators, e);
  }
  if (values.size() != count) refuse_field(path, field, text, std::to_string(count) + " numbers");
  return values;
}

void read_sizes(const std::string& path, const std::string& field, const std::string& text,
                VoxelLayout& layout) {
  const std::vector<double> sizes = header_numbers(path, field, text, 3);
  for (std::size_t k = 0; k < 3; ++k) {
    if (!(sizes[k] >= 1 && sizes[k] <= 1e9)) refuse_field(path, field, text, "numbers from 1 on");
    layout.dims[k] = static_cast<std::int64_t>(sizes[k]);
  }
  check_voxel_count(path, layout);
}

std::uint64_t header_skip(const std::string& path, const std::string& field, const std::string& text) {
  if (text.empty()) return 0;
  const std::int64_t n = header_integer(path, field, text);
  if (n < 0 || n > 1000000000) refuse_field(path, field, text, "0 to 1e9");
  return static_cast<std::uint64_t>(n);
}

VoxelType voxel_type(const std::string& path, const std::string& field, const std::string& name,
                     const std::map<std::string, VoxelType>& types, const char* example) {
  const auto found = types.find(name);
  if (found == types.end())
    refuse_field(path, field, name, std::string("whole or real numbers, such as ") + example);
  return found->second;
}

std::unique_ptr<LabelBytes> data_apart(const std::string& path, const std::string& name) {
  return std::make_unique<LabelBytes>(named_data_file(path, name), LabelBytes::Packing::none);
}

}  // namespace tactus
