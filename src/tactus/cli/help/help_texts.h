#pragma once
/// Completions for shells and the page for `man`, made from the verbs.
#include <string>

namespace CLI {
class App;
}

namespace tactus {

/// tactus(1), as troff.
std::string man_page(const CLI::App& app, const std::string& version);
/// @param shell bash, zsh or fish @throws usage Error
std::string shell_completion(const CLI::App& app, const std::string& shell);

}  // namespace tactus
