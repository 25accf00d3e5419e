#pragma once
/// Everything that the world learns from images, apart from the mesh itself: that stays on the devices.
#include <cstdint>
#include <vector>

#include "tactus/contact/obstacles.h"
#include "tactus/sim/notice.h"
#include "tactus/sim/reach.h"
#include "tactus/tissue/cut/lattice_cutter.h"

namespace tactus {

/// How long a stage on the host took, on the clock of now_s().
struct HostTime {
  const char* stage;
  double begin_s, end_s;
};

/// Made by Perception::observe, taken by World::set_surface.
struct Observation {
  bool is_new = false;  ///< images came; else nothing below is set
  std::int64_t tick = 0;
  double captured_s = 0;                ///< on the clock of now_s()
  double released_s = 0;                ///< when a live set was there; 0: the images are not live
  double observe_s = 0;                 ///< that observe() took
  std::vector<HostTime> times;          ///< of its stages
  std::vector<ToolMotion> tools;        ///< tracked ones, in the scene's order
  std::vector<Reach> tool_reaches;      ///< of those that are there and touch
  std::vector<cut::BladeStrip> strips;  ///< by blades of the scene: the strip that a tracked edge passed
  std::vector<Notice> notices;
};

}  // namespace tactus
