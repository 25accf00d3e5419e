#pragma once
/// Progress of preparations that take seconds.
#include <cstdio>

#include "tactus/base/log.h"
#include "tactus/sim/scene.h"

namespace tactus {

/// Bodies of so many cubes take seconds to make.
inline constexpr double kManyCubes = 1e6;

/// "body 'b': 10.2 million cubes: made", where they are many.
inline void report_many_cubes(const BodyDescription& body, double cubes, const char* what) {
  if (cubes < kManyCubes) return;
  char text[32];
  std::snprintf(text, sizeof text, "%.3g million", 1e-6 * cubes);
  log_info("body '" + body.name + "': " + text + what);
}

}  // namespace tactus
