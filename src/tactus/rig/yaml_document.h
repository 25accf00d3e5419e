#pragma once
/// YAML files through yaml-cpp, which by itself loops for ever on ", x" and follows every bracket down.
#include <yaml-cpp/yaml.h>

#include <string>

namespace tactus {

/// The one document of a YAML text. Bounded first: a megabyte, 64 deep, 100,000 values, 1000 aliases.
/// @throws usage Error "FILE:LINE: REASON": not valid YAML, beyond the bounds, a second document.
YAML::Node parse_yaml(const std::string& text, const std::string& file);

/// @throws Error when the file can't be read; as parse_yaml.
YAML::Node load_yaml(const std::string& file);

}  // namespace tactus
