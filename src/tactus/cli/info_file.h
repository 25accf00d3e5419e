#pragma once
/// Figures of a mesh or a label volume, for `tactus info FILE`.
#include <nlohmann/json.hpp>
#include <string>

namespace tactus {

/// Prints bounds, volume, open edges and pieces of a mesh, or sizes, volumes and bounds of the labels of a
/// volume.
/// @param unit_m metres per unit of length in a mesh file
/// @return the same as JSON
/// @throws Error when the file can't be read.
nlohmann::json print_file_info(const std::string& path, double unit_m);

}  // namespace tactus
