#include "support/data_folder.h"

#include <cstdlib>
#include <filesystem>

namespace tactus {

std::string data_folder() {
  const char* env = std::getenv("TACTUS_DATA");
  std::string folder = env != nullptr ? env : source_path("../shared/data");
  if (!std::filesystem::is_directory(folder)) return "";
  ::setenv("TACTUS_DATA", folder.c_str(), 1);
  return folder;
}

std::string without_data(const std::string& what) {
  return "needs " + what + " in the folder TACTUS_DATA; docs/data.md says how to get it";
}

std::string source_path(const std::string& name) { return TACTUS_SOURCE_DIR "/" + name; }

}  // namespace tactus
