#pragma once
/// GLFW's window with an OpenGL 4.5 context, and its input, collected between pictures. Internal to window/.
#include <string>

#include "tactus/window/window_input.h"

struct GLFWwindow;

namespace tactus {

/// One at a time, on the main thread.
class GlfwWindow {
 public:
  /// @throws Error with the way out when there is no display or no OpenGL 4.5.
  GlfwWindow(const std::string& title, Vec2i size_px);
  ~GlfwWindow();
  GlfwWindow(const GlfwWindow&) = delete;
  GlfwWindow& operator=(const GlfwWindow&) = delete;

  GLFWwindow* get() const { return window_; }
  bool is_closed() const;
  void set_title(const std::string& title);
  Vec2i framebuffer_px() const;
  /// Pixels of the framebuffer in a unit of the window system; text is larger by this.
  float pixels_per_unit() const;
  float content_scale() const;
  /// Waits for input, or so long. @param wants_mouse whether a panel has the mouse: a drag that begins there
  /// is the panel's
  WindowInput wait(double seconds, bool wants_mouse);
  void show_picture();
  /// Wakes wait(), from any thread.
  static void wake();

 private:
  static GlfwWindow& of(GLFWwindow* window);
  void on_button(int button, int action, int mods);
  void on_cursor(double x, double y);

  GLFWwindow* window_ = nullptr;
  std::string title_;
  WindowInput input_;
  Drag drag_ = Drag::none;
  int drag_button_ = -1;
  bool wants_mouse_ = false;
};

}  // namespace tactus
