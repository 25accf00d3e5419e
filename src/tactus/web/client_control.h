#pragma once
/// Requests of viewers of a page.
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "tactus/run/run_control.h"
#include "tactus/web/client_message.h"
#include "tactus/web/web_past.h"

namespace tactus {

/// Checks messages of viewers and hands them to the run's control. Knows no sockets.
class ClientControl {
 public:
  struct Options {
    bool is_allowed = false;                          ///< else every message is refused by name
    std::vector<std::string> held;                    ///< obstacles and blades that viewers may move
    std::vector<SceneParameter> parameters;           ///< those that viewers may set
    std::vector<std::string> grabbed = {};            ///< bodies that viewers may grab
    WebPast* past = nullptr;                          ///< frames that viewers may go back to; nullptr: none
    std::function<std::string()> why_not_again = {};  ///< "": viewers may simulate again from there
  };
  /// @param run must outlive this
  ClientControl(Options options, RunControl& run) : options_(std::move(options)), run_(run) {}

  /// @returns the error of a message that was refused, with the remedy; or "".
  std::string handle(std::string_view text);
  /// Lets tissue go that nobody held for kGrabLasts_s: the viewer left, or its network did. Before each
  /// frame.
  void let_go_of_old_grabs(double now_s);
  static constexpr double kGrabLasts_s = 2;

 private:
  void check(const ClientMessage& message) const;
  void grab(const ClientMessage& message);
  void release();
  void see(const ClientMessage& message);
  void simulate_again();
  void leave_past();
  void carry_out(const ClientMessage& message);

  Options options_;
  RunControl& run_;
  std::mutex mutex_;
  double grabbed_s_ = -1;  ///< the last message of a grab, on the clock of now_s(); -1: nothing is held
};

}  // namespace tactus
