#pragma once
/// One line of news on standard error. Results go to standard output or files, never here.
#include <string_view>

namespace tactus {
enum class LogLevel { quiet, warning, info, debug };
/// Least important level that is printed from now on (default: info). Thread-safe.
void set_log_level(LogLevel level);
LogLevel log_level();
void log_warning(std::string_view message);
void log_info(std::string_view message);
void log_debug(std::string_view message);
}  // namespace tactus
