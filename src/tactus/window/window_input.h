#pragma once
/// Input of a window, collected between pictures.
#include <vector>

#include "tactus/window/camera_moves.h"

namespace tactus {

enum class Drag : std::uint8_t { none, orbit, pan, tool, grab };

/// Since the last picture. A click that is shorter than a picture takes isn't lost.
struct WindowInput {
  PicturePoint orbited_px, panned_px;  ///< by drags, in pixels of the framebuffer
  float wheel = 0, tool_wheel = 0;     ///< the second with shift, or while tissue is held
  Drag begun = Drag::none;             ///< at pressed_px
  Drag moved = Drag::none;             ///< to mouse_px
  bool is_released = false;
  std::vector<unsigned> typed;
  bool pressed_tab = false;
  int past_steps = 0;  ///< arrows: < 0 back, > 0 on
  bool pressed_home = false, pressed_end = false;
  PicturePoint pressed_px, mouse_px;
  bool is_empty = true;
};

}  // namespace tactus
