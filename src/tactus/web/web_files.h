#pragma once
/// The page's files, in the program.
#include <span>
#include <string>
#include <string_view>

namespace tactus {

struct WebFile {
  std::string_view name, type, text;  ///< type: of its contents, for HTTP
};

/// All of them. Nothing else is served.
std::span<const WebFile> web_files();
/// nullptr where there is none of this name.
const WebFile* find_web_file(std::string_view name);
/// "", or what the page lacks and its purpose.
std::string web_page_missing();

}  // namespace tactus
