#pragma once
/// Liquids, drawn from their particles in screen space: balls, their front smoothed over the picture, and the
/// length of each ray in the liquid (van der Laan et al. 2009; the filter: Truong & Yuksel 2018). Internal to
/// view/; a context is current wherever it is used.
#include <array>
#include <cstdint>
#include <vector>

#include "tactus/view/gl_mesh.h"
#include "tactus/view/gl_objects.h"
#include "tactus/view/liquid_balls.h"
#include "tactus/view/projection.h"
#include "tactus/view/scene.h"

namespace tactus {

/// One picture's view of all liquids.
struct LiquidProjection {
  Mat4 eye_world, world_eye, clip_eye;
  float near_m = 0, tangent_x = 0, tangent_y = 0;  ///< of half the picture's angles
  float middle_x = 0, middle_y = 0;                ///< tangents of the ray through the picture's middle
};

class GlLiquid {
 public:
  GlLiquid(GLsizei width_px, GLsizei height_px);

  /// Makes the maps of one liquid, except where the picture so far hides it.
  /// @param drawn framebuffer of the picture so far
  void draw_maps(const ViewLiquid& liquid, std::vector<LiquidBall> balls, const LiquidProjection& view,
                 GLuint drawn);
  /// Draws it into the framebuffer that is bound. `surface()` has been told of the light.
  void draw(const ViewLiquid& liquid, const LiquidProjection& view);
  const GlProgram& surface() const { return surface_; }

 private:
  void find_tiles(const LiquidProjection& view);
  void draw_balls(const ViewLiquid& liquid, const LiquidProjection& view);
  void smooth(const ViewLiquid& liquid, const LiquidProjection& view);
  void draw_tiles(const GlProgram& program) const;

  GLsizei width_px_, height_px_;
  GlProgram ball_, smooth_, surface_;
  GlTexture front_[2], thickness_, behind_, depth_;
  GlFramebuffer ball_target_, front_target_[2], thickness_target_, copy_;
  GlVertexArray ball_array_, tile_array_;
  GlStreamBuffer ball_buffer_, tile_buffer_;
  std::vector<LiquidBall> balls_;
  /// Squares of the picture that balls cover: only they are smoothed and drawn.
  std::vector<std::array<float, 2>> tiles_;
  std::vector<std::uint8_t> is_tile_;
};

}  // namespace tactus
