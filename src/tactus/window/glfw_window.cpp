#include "tactus/window/glfw_window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include "tactus/base/error.h"

namespace tactus {
namespace {

std::string& last_glfw_error() {
  static std::string text;
  return text;
}

void on_glfw_error(int, const char* text) { last_glfw_error() = text == nullptr ? "" : text; }

[[noreturn]] void refuse_display() {
  throw Error("no window can be opened: " + last_glfw_error() +
              "; set DISPLAY (a desktop does; ssh -X; Xvfb), or let 'tactus run SCENE' write a film");
}

[[noreturn]] void refuse_opengl() {
  throw Error(
      "no window with OpenGL 4.5 can be opened: " + last_glfw_error() +
      "; LIBGL_ALWAYS_SOFTWARE=1 lets Mesa draw on the CPU (Debian package libgl1-mesa-dri), and 'tactus run "
      "SCENE' writes a film");
}

}  // namespace

GlfwWindow::GlfwWindow(const std::string& title, Vec2i size_px) : title_(title) {
  glfwSetErrorCallback(on_glfw_error);
  if (glfwInit() == GLFW_FALSE) refuse_display();
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 4);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 5);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHintString(GLFW_X11_CLASS_NAME, "tactus");
  window_ = glfwCreateWindow(size_px.x, size_px.y, title.c_str(), nullptr, nullptr);
  if (window_ == nullptr) {
    glfwTerminate();
    refuse_opengl();
  }
  glfwSetWindowSizeLimits(window_, 320, 200, GLFW_DONT_CARE, GLFW_DONT_CARE);
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(1);
  glfwSetWindowUserPointer(window_, this);
  glfwSetMouseButtonCallback(window_, [](GLFWwindow* w, int button, int action, int mods) {
    of(w).on_button(button, action, mods);
  });
  glfwSetCursorPosCallback(window_, [](GLFWwindow* w, double x, double y) { of(w).on_cursor(x, y); });
  glfwSetScrollCallback(window_, [](GLFWwindow* w, double, double by) {
    GlfwWindow& self = of(w);
    self.input_.is_empty = false;
    if (self.wants_mouse_) return;
    const bool shift =
        glfwGetKey(w, GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS || glfwGetKey(w, GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
    (shift || self.drag_ == Drag::grab ? self.input_.tool_wheel : self.input_.wheel) +=
        static_cast<float>(by);
  });
  glfwSetCharCallback(window_, [](GLFWwindow* w, unsigned code) {
    of(w).input_.typed.push_back(code);
    of(w).input_.is_empty = false;
  });
  glfwSetKeyCallback(window_, [](GLFWwindow* w, int key, int, int action, int) {
    WindowInput& input = of(w).input_;
    input.is_empty = false;
    if (action == GLFW_RELEASE) return;
    if (key == GLFW_KEY_LEFT) --input.past_steps;
    if (key == GLFW_KEY_RIGHT) ++input.past_steps;
    if (key == GLFW_KEY_HOME) input.pressed_home = true;
    if (key == GLFW_KEY_END) input.pressed_end = true;
    if (key == GLFW_KEY_TAB && action == GLFW_PRESS) input.pressed_tab = true;
  });
}

GlfwWindow::~GlfwWindow() {
  glfwDestroyWindow(window_);
  glfwTerminate();
}

GlfwWindow& GlfwWindow::of(GLFWwindow* window) {
  return *static_cast<GlfwWindow*>(glfwGetWindowUserPointer(window));
}

void GlfwWindow::on_button(int button, int action, int mods) {
  input_.is_empty = false;
  if (action == GLFW_RELEASE) {
    if (button != drag_button_) return;
    input_.is_released = drag_ == Drag::grab;
    drag_ = Drag::none;
    return;
  }
  if (wants_mouse_ || drag_ != Drag::none) return;
  const bool is_left = button == GLFW_MOUSE_BUTTON_LEFT;
  drag_ = !is_left                         ? Drag::pan
          : (mods & GLFW_MOD_SHIFT) != 0   ? Drag::tool
          : (mods & GLFW_MOD_CONTROL) != 0 ? Drag::grab
                                           : Drag::orbit;
  drag_button_ = button;
  input_.begun = input_.moved = drag_;
  input_.pressed_px = input_.mouse_px;
}

void GlfwWindow::on_cursor(double x, double y) {
  const float scale = pixels_per_unit();
  const PicturePoint at{scale * static_cast<float>(x), scale * static_cast<float>(y)};
  const PicturePoint by{at.x - input_.mouse_px.x, at.y - input_.mouse_px.y};
  input_.mouse_px = at;
  input_.is_empty = false;
  if (drag_ != Drag::none) input_.moved = drag_;
  if (drag_ != Drag::orbit && drag_ != Drag::pan) return;
  PicturePoint& sum = drag_ == Drag::orbit ? input_.orbited_px : input_.panned_px;
  sum = {sum.x + by.x, sum.y + by.y};
}

bool GlfwWindow::is_closed() const { return glfwWindowShouldClose(window_) == GLFW_TRUE; }

void GlfwWindow::set_title(const std::string& title) {
  if (title == title_) return;
  title_ = title;
  glfwSetWindowTitle(window_, title.c_str());
}

Vec2i GlfwWindow::framebuffer_px() const {
  int width = 0, height = 0;
  glfwGetFramebufferSize(window_, &width, &height);
  return {width, height};
}

float GlfwWindow::pixels_per_unit() const {
  int width = 0, height = 0;
  glfwGetWindowSize(window_, &width, &height);
  return width > 0 ? static_cast<float>(framebuffer_px().x) / static_cast<float>(width) : 1.F;
}

float GlfwWindow::content_scale() const {
  float x = 1, y = 1;
  glfwGetWindowContentScale(window_, &x, &y);
  return y;
}

WindowInput GlfwWindow::wait(double seconds, bool wants_mouse) {
  wants_mouse_ = wants_mouse;
  if (seconds > 0)
    glfwWaitEventsTimeout(seconds);
  else
    glfwPollEvents();
  WindowInput seen = std::move(input_);
  input_ = {};
  input_.mouse_px = seen.mouse_px;
  return seen;
}

void GlfwWindow::show_picture() { glfwSwapBuffers(window_); }

void GlfwWindow::wake() { glfwPostEmptyEvent(); }

}  // namespace tactus
