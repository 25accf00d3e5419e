#pragma once
/// Panels over the picture, drawn with Dear ImGui. Internal to window/.
#include "tactus/view/renderer.h"
#include "tactus/window/camera_moves.h"
#include "tactus/window/panel_model.h"

struct GLFWwindow;

namespace tactus {

/// Requests of the panels' buttons.
struct PanelRequests {
  bool toggle_pause = false, step = false, restart = false, again = false;
  int past_frame = 0;     ///< that is to be shown; 0: as before
  std::string parameter;  ///< that is set; "": none
  double value = 0;       ///< of it
};

/// Owns ImGui's context; the window's OpenGL context is current wherever this is used.
class Panels {
 public:
  explicit Panels(GLFWwindow* window);
  ~Panels();
  Panels(const Panels&) = delete;
  Panels& operator=(const Panels&) = delete;

  /// Before the others, for each picture. @param scale of text: 1 where a pixel is 1/96 inch
  void begin(float scale);
  /// Into the framebuffer.
  void end();
  float scale() const { return scale_; }
  bool wants_mouse() const;
  bool wants_text() const;

  PanelRequests draw(const PanelModel& model, bool is_paused);
  void draw_help(const MouseHolds& holds);
  /// A line in the middle, before there is a picture.
  void draw_message(const std::string& text);
  /// On the picture, below the panels.
  void draw_labels(const std::vector<PlacedLabel>& labels);
  void draw_arrows(const std::vector<ContactArrow>& contacts, const ViewCamera& camera, float longest_m);
  /// From tissue that is held to where it is pulled.
  void draw_spring(Vec3f from_m, Vec3f to_m, const ViewCamera& camera);

 private:
  void load_font(float scale);
  /// @param top_px below the curves
  void draw_past(const PanelModel::Past& past, PanelRequests& requests);
  void draw_sliders(const PanelModel& model, float top_px, PanelRequests& requests);

  float scale_ = 0;
};

}  // namespace tactus
