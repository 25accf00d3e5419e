#pragma once
/// Requests of viewers of a page.
#include <string>
#include <string_view>
#include <vector>

#include "tactus/run/run_control.h"
#include "tactus/web/client_message.h"

namespace tactus {

/// Checks messages of viewers and hands them to the run's control. Knows no sockets.
class ClientControl {
 public:
  struct Options {
    bool is_allowed = false;                 ///< else every message is refused by name
    std::vector<std::string> held;           ///< obstacles and blades that viewers may move
    std::vector<SceneParameter> parameters;  ///< those that viewers may set
  };
  /// @param run must outlive this
  ClientControl(Options options, RunControl& run) : options_(std::move(options)), run_(run) {}

  /// @returns the error of a message that was refused, with the remedy; or "".
  std::string handle(std::string_view text);

 private:
  void check(const ClientMessage& message) const;

  Options options_;
  RunControl& run_;
};

}  // namespace tactus
