#pragma once
/// OpenCV's predefined dictionaries of square markers.
#include <string>
#include <vector>

namespace tactus {

/// "4X4_50", ..., in the order of OpenCV's enumeration.
const std::vector<std::string>& marker_dictionaries();
/// How many markers a dictionary has: ids are below that. @throws usage Error naming it and the nearest.
int marker_count(const std::string& dictionary);
/// Its place among the dictionaries. @throws usage Error likewise.
int marker_dictionary(const std::string& name);

}  // namespace tactus
