#pragma once
/// Headers of named fields, as NRRD and MetaImage have them. Internal to io.
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tactus/io/labels/label_voxels.h"

namespace tactus {

using HeaderFields = std::map<std::string, std::string>;

std::string trimmed(std::string_view text);

/// So many numbers of a field. @throws Error naming the file, the field and its value.
std::vector<double> header_numbers(const std::string& path, const std::string& field, const std::string& text,
                                   std::size_t count, const char* separators = " \t");

/// Voxels along each axis. @throws Error as header_numbers and check_voxel_count.
void read_sizes(const std::string& path, const std::string& field, const std::string& text,
                VoxelLayout& layout);

/// Bytes or lines to leave out, from 0 to 1e9; "" is 0.
std::uint64_t header_skip(const std::string& path, const std::string& field, const std::string& text);

/// The type of this name. @throws Error naming the file, the field and `example`.
VoxelType voxel_type(const std::string& path, const std::string& field, const std::string& name,
                     const std::map<std::string, VoxelType>& types, const char* example);

/// The file that holds the voxels, apart from the header. @throws as named_data_file.
std::unique_ptr<LabelBytes> data_apart(const std::string& path, const std::string& name);

}  // namespace tactus
