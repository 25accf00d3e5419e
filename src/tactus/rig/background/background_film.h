#pragma once
/// The empty room from a film of it, or of a subject that moves before it.
#include <string>

#include "tactus/rig/background/background_model.h"

namespace tactus {

struct LearntRoom {
  BackgroundModel model;
  Index width_px = 0, height_px = 0;
  int frames = 0;        ///< of the film
  double flicker = 0;    ///< standard deviation of the frames' mean brightness [grey levels]
  double sharpness = 0;  ///< standard deviation of the Laplacian [grey levels]: blurred pictures have little
};

/// A still picture, or a film. `median`: the subject is in it and moves; 31 frames spread over the film are
/// taken, and a subject before a pixel in fewer than half of them is not learnt.
/// @throws Error naming the file when no frame can be read.
LearntRoom learn_room(const std::string& film, bool median);

}  // namespace tactus
