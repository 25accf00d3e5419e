#pragma once
/// How a body is at the end of a frame.
#include <cmath>

#include "tactus/tissue/node_check_record.h"
#include "tactus/tissue/rigid_motion.h"
#include "tactus/tissue/tled/tled_data.h"

namespace tactus {

/// At the end of the last frame that was waited for.
struct BodyStatus {
  RigidMotion motion;
  tled::CubeExtremes strain{1, 0, 1, 0, 0};  ///< of its elements, at the end of the last part of the frame
  NodeCheckRecord node_check;                ///< its fastest node over the frame; -1: nothing moved
  bool is_frozen = false;                    ///< it blew up, and rests since
  float fastest_m_s() const { return std::sqrt(node_check.fastest2_m2_s2); }
};

}  // namespace tactus
