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

std::string ClientControl::handle(std::string_view text) {
  ClientMessage message;
  try {
    if (!options_.is_allowed) throw Error("viewers may only look: start the run with --web-control");
    message = parse_client_message(text);
    check(message);
  } catch (const Error& error) {
    return error.what();
  }
  switch (message.kind) {
    case ClientMessage::Kind::pause:
      run_.set_paused(true);
      break;
    case ClientMessage::Kind::run:
      run_.set_paused(false);
      break;
    case ClientMessage::Kind::step:
      run_.step();
      break;
    case ClientMessage::Kind::pose:
      message.is_put ? run_.put_tool(message.name, message.T_world_obstacle)
                     : run_.move_tool(message.name, message.T_world_obstacle, message.most_m_s);
      break;
    case ClientMessage::Kind::grab:
      grab(message);
      break;
    case ClientMessage::Kind::release:
      release();
      break;
    case ClientMessage::Kind::set:
      run_.set_parameter(message.name, message.value);
      break;
  }
  return "";
}

}  // namespace tactus
