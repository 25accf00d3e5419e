#include "tactus/web/web_files.h"

#include <algorithm>

namespace tactus {

const WebFile* find_web_file(std::string_view name) {
  const std::span<const WebFile> all = web_files();
  const auto found = std::find_if(all.begin(), all.end(), [&](const WebFile& f) { return f.name == name; });
  return found == all.end() ? nullptr : &*found;
}

std::string web_page_missing() {
  return find_web_file("three.js") != nullptr ? "" : "three (make web): no page for --web, no --report";
}

}  // namespace tactus
