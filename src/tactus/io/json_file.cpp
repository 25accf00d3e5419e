#include "tactus/io/json_file.h"

#include <nlohmann/json.hpp>

#include "tactus/base/safe_file.h"

namespace tactus {

void write_json_file(const std::string& path, const nlohmann::json& value) {
  // Bytes that aren't UTF-8 (a file name, perhaps) are replaced: they must not cost the results.
  write_file(path, value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace tactus
