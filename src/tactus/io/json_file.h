#pragma once
/// Results as JSON files.
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace tactus {

/// Writes `value`, indented, completely or not at all. NaN and infinity become null (JSON has neither).
/// @throws Error naming the path and the reason.
void write_json_file(const std::string& path, const nlohmann::json& value);

}  // namespace tactus
