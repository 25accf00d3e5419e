#pragma once
/// Messages that viewers send. They come from strangers: bounded first, then read.
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "tactus/base/vec.h"

namespace tactus {

inline constexpr std::size_t kMostClientBytes = 4096;

struct ClientMessage {
  enum class Kind : std::uint8_t { pause, run, step, pose, set, grab, release, see, again };
  Kind kind = Kind::pause;
  std::string name;         ///< of the obstacle, of the parameter, or of the body that is grabbed
  Rigidd T_world_obstacle;  ///< pose
  bool is_put = false;      ///< pose: put down there, not led there
  double most_m_s = std::numeric_limits<double>::infinity();  ///< pose: it goes no faster
  double value = 0;                                           ///< set
  Vec3d point_m, target_m;                                    ///< grab
  std::optional<int> frame, steps;                            ///< see: one of both
};

/// Reads one message (docs/web.md). @throws Error naming the key, its value and the values allowed.
ClientMessage parse_client_message(std::string_view text);

/// Frames that a viewer has got (`{"do": "got"}`, docs/web.md), who need no control for that; 0 for any other
/// message.
int frames_got(std::string_view text);

}  // namespace tactus
