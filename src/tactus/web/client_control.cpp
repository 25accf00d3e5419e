#include "tactus/web/client_control.h"

#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"
#include "tactus/base/timing.h"

namespace tactus {

void ClientControl::check(const ClientMessage& message) const {
  if (message.kind == ClientMessage::Kind::pose &&
      std::find(options_.held.begin(), options_.held.end(), message.name) == options_.held.end())
    throw Error("'obstacle': '" + printable(message.name.substr(0, 16)) + "' is not held" +
                (options_.held.empty() ? "; nothing of the scene has 'held: true'"
                                       : suggestion(message.name, options_.held)));
  if (message.kind == ClientMessage::Kind::grab &&
      std::find(options_.grabbed.begin(), options_.grabbed.end(), message.name) == options_.grabbed.end())
    throw Error("'body': '" + printable(message.name.substr(0, 48)) + "' can't be grabbed" +
                (options_.grabbed.empty() ? "; the scene has no body with 'contact: true'"
                                          : suggestion(message.name, options_.grabbed)));
  if (message.kind != ClientMessage::Kind::set) return;
  std::vector<std::string> known;
  for (const SceneParameter& p : options_.parameters) {
    known.push_back(p.name);
    if (p.name != message.name) continue;
    if (!p.allows(message.value))
      throw Error("'" + p.name + "': " + number_text(message.value) + ", expected " + p.range_text());
    return;
  }
  throw Error("'parameter': '" + printable(message.name.substr(0, 48)) + "' may not change" +
              (known.empty() ? "; nothing of this run may" : suggestion(message.name, known)));
}

void ClientControl::grab(const ClientMessage& message) {
  const std::lock_guard lock(mutex_);
  grabbed_s_ = now_s();
  Grab grab;
  grab.body = message.name;
  grab.point_m = message.point_m;
  grab.target_m = message.target_m;
  run_.set_grab(grab);
}

void ClientControl::release() {
  const std::lock_guard lock(mutex_);
  grabbed_s_ = -1;
  run_.set_grab(std::nullopt);
}

void ClientControl::let_go_of_old_grabs(double now_s) {
  const std::lock_guard lock(mutex_);
  if (grabbed_s_ < 0 || now_s - grabbed_s_ < kGrabLasts_s) return;
  grabbed_s_ = -1;
  run_.set_grab(std::nullopt);
}

/// Nobody may look at a frame while the next one replaces it.
void ClientControl::see(const ClientMessage& message) {
  if (options_.past == nullptr) throw Error("'see': this run keeps no frames");
  run_.set_paused(true);
  message.frame ? options_.past->see(*message.frame) : options_.past->move(*message.steps);
}

void ClientControl::simulate_again() {
  if (options_.past == nullptr) throw Error("'again': this run keeps no frames");
  if (const std::string why = options_.why_not_again ? options_.why_not_again() : ""; !why.empty())
    throw Error("'again': " + why);
  options_.past->ask_again();
  release();
  run_.go_back();
}

void ClientControl::leave_past() {
  if (options_.past != nullptr) options_.past->leave();
}

void ClientControl::carry_out(const ClientMessage& message) {
  switch (message.kind) {
    case ClientMessage::Kind::pause:
      return run_.set_paused(true);
    case ClientMessage::Kind::run:
      leave_past();
      return run_.set_paused(false);
    case ClientMessage::Kind::step:
      leave_past();
      return run_.step();
    case ClientMessage::Kind::pose:
      return message.is_put ? run_.put_tool(message.name, message.T_world_obstacle)
                            : run_.move_tool(message.name, message.T_world_obstacle, message.most_m_s);
    case ClientMessage::Kind::grab:
      return grab(message);
    case ClientMessage::Kind::release:
      return release();
    case ClientMessage::Kind::set:
      return run_.set_parameter(message.name, message.value);
    case ClientMessage::Kind::see:
      return see(message);
    case ClientMessage::Kind::again:
      return simulate_again();
  }
}

std::string ClientControl::handle(std::string_view text) {
  try {
    if (!options_.is_allowed) throw Error("viewers may only look: start the run with --web-control");
    const ClientMessage message = parse_client_message(text);
    check(message);
    carry_out(message);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace tactus
