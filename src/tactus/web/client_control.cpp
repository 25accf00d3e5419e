#include "tactus/web/client_control.h"

#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/base/printable.h"

namespace tactus {

void ClientControl::check(const ClientMessage& message) const {
  if (message.kind == ClientMessage::Kind::pose &&
      std::find(options_.held.begin(), options_.held.end(), message.name) == options_.held.end())
    throw Error("'obstacle': '" + printable(message.name.substr(0, 16)) + "' is not held" +
                (options_.held.empty() ? "; nothing of the scene has 'held: true'"
                                       : suggestion(message.name, options_.held)));
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
      run_.move_tool(message.name, message.T_world_obstacle);
      break;
    case ClientMessage::Kind::set:
      run_.set_parameter(message.name, message.value);
      break;
  }
  return "";
}

}  // namespace tactus
