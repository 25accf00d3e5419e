#pragma once
/// Pictures with OpenGL 4.5, on a GPU or on Mesa's software driver: without a screen through EGL, or in the
/// context of a window.
#include <memory>
#include <string>
#include <vector>

#include "tactus/geom/image/image.h"
#include "tactus/view/scene.h"
#include "tactus/view/view_camera.h"

namespace tactus {

struct RendererOptions {
  Index width_px = 1280, height_px = 720;  ///< 16 to 8192
  /// Per pixel, against jagged edges: 1, 2, 4 or 8. 0: 4 on a GPU; on the software driver, where they cost
  /// three times the rest of the frame, 1 and edges that are smoothed afterwards.
  int samples = 0;
  Index shadow_map_px = 1024;     ///< side of the key light's shadow map, 64 to 8192; 0: no shadows
  bool ambient_occlusion = true;  ///< darken surfaces under and beside others
  /// Draws in the context that is current here, and at each later call, too: a window's. Without, in a
  /// context of its own.
  bool in_current_context = false;
};

/// A label where it is seen on a picture: its upper left corner, in pixels from the picture's.
struct PlacedLabel {
  std::string text;
  Index x_px = 0, y_px = 0;
  float height_px = 13;
  Vec3f color{};  ///< sRGB
};

/// Draws snapshots into images. Buffers live as long as the renderer and grow by doubling, so drawing a scene
/// of the same size again allocates nothing on the GPU. One thread at a time, not always the same one.
class Renderer {
 public:
  /// @throws Error for an option out of its range (naming it), or with the reason when there is no
  /// OpenGL 4.5.
  explicit Renderer(const RendererOptions& options = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// The picture of `scene`, sRGB.
  /// @throws Error when a mesh has an index out of its range or as many normals as neither 0 nor its
  /// vertices.
  ColorImage render(const ViewScene& scene, const ViewCamera& camera);
  /// The same into `image`, whose memory is reused.
  void render(const ViewScene& scene, const ViewCamera& camera, ColorImage& image);
  /// The same picture, without its labels, into the current draw framebuffer. Labels are in labels().
  void draw(const ViewScene& scene, const ViewCamera& camera);
  /// As draw(), from an eye of a headset. Light and ground lie as for `camera`.
  /// @param is_same scene and camera are those of the last picture: nothing is copied to the GPU again
  void draw_eye(const ViewScene& scene, const ViewCamera& camera, const ViewEye& eye, bool is_same);
  /// The depth of the last picture into the current draw framebuffer, whose depth is of 32-bit floats.
  void copy_depth();
  /// The last picture again, into the framebuffer that is current now.
  void draw_again();
  /// Those of the last picture.
  const std::vector<PlacedLabel>& labels() const;
  /// Changes the size of the next pictures. @throws Error for a size out of range.
  void resize(Index width_px, Index height_px);
  /// Distance from the eye, along its axis, of the surface at a pixel of the last picture [m]; where nothing
  /// is, as depths_m(). `y_px` counts from above; the pixel is in the picture.
  float depth_m(Index x_px, Index y_px);
  /// Distances of the surfaces in the last picture from the eye, along its axis [m]; row by row from above.
  /// Where nothing is, as far as the farthest that could be drawn.
  std::vector<float> depths_m();

  /// The driver's name and version, for reports.
  const std::string& description() const;
  /// How surfaces in the memory of `device` reach OpenGL here, for reports: shared, or copied and why.
  static std::string sharing(const Device& device);
  /// Empty when pictures can be drawn here, else the reason.
  static std::string why_unavailable();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace tactus
