#pragma once
/// Messages that viewers send. They come from strangers: bounded first, then read.
#include <string>
#include <string_view>

#include "tactus/base/vec.h"

namespace tactus {

inline constexpr std::size_t kMostClientBytes = 4096;

struct ClientMessage {
  enum class Kind : std::uint8_t { pause, run, step, pose, set };
  Kind kind = Kind::pause;
  std::string name;         ///< of the obstacle, or of the parameter
  Rigidd T_world_obstacle;  ///< pose
  double value = 0;         ///< set
};

/// Reads one message (docs/web.md). @throws Error naming the key, its value and the values allowed.
ClientMessage parse_client_message(std::string_view text);

}  // namespace tactus
