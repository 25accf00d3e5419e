#include "tactus/base/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <atomic>

#include "tactus/base/camera_lines.h"
#include "tactus/base/printable.h"

namespace tactus {
namespace {
std::atomic<LogLevel> current_level{LogLevel::info};
spdlog::logger& logger() {
  static spdlog::logger instance = [] {
    spdlog::logger made("tactus", std::make_shared<spdlog::sinks::stderr_color_sink_mt>());
    made.set_pattern("%^%l%$: %v");
    return made;
  }();
  return instance;
}
}  // namespace

void set_log_level(LogLevel level) {
  static constexpr spdlog::level::level_enum kLevels[] = {spdlog::level::off, spdlog::level::warn,
                                                          spdlog::level::info, spdlog::level::debug};
  current_level = level;
  logger().set_level(kLevels[static_cast<int>(level)]);
}
LogLevel log_level() { return current_level; }
void log_warning(std::string_view message) {
  for (const std::string& line : grouped_camera_lines(message)) logger().warn("{}", printable(line));
}
void log_info(std::string_view message) { logger().info("{}", printable(message)); }
void log_debug(std::string_view message) { logger().debug("{}", printable(message)); }

}  // namespace tactus
