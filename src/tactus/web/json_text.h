#pragma once
/// JSON as it goes to viewers.
#include <nlohmann/json.hpp>
#include <string>

namespace tactus {

/// On one line. JSON has no infinite numbers: they become null. Bytes that are no UTF-8, which files may
/// have, become U+FFFD.
inline std::string json_text(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace tactus
