#pragma once
/// The maps that hold a picture's light: where the sun and the sky are visible. Internal to view/; a context
/// is current wherever they are used.
#include <span>

#include "tactus/view/gl_mesh.h"
#include "tactus/view/gl_objects.h"
#include "tactus/view/picture_layout.h"

namespace tactus {

inline void delete_sampler(GLuint name) { glDeleteSamplers(1, &name); }
using GlSampler = GlName<delete_sampler>;

class GlLight {
 public:
  /// @param shadow_map_px side; 0: no shadows  @param occlusion whether surfaces hide the sky
  GlLight(GLsizei shadow_map_px, bool occlusion);
  /// Draws the maps. @param casters the meshes that cast shadows
  void draw(std::span<const GlMesh* const> casters, const PictureLayout& layout);
  /// For the shaders that know the light (kLight), and the ground's.
  void bind() const;
  /// Sets all uniforms of such a program but those of the eye.
  void set_uniforms(const GlProgram& program, const PictureLayout& layout) const;

 private:
  void draw_sun(std::span<const GlMesh* const> casters, const PictureLayout& layout);
  void draw_heights(std::span<const GlMesh* const> casters, const PictureLayout& layout);
  void draw_floor(const PictureLayout& layout);
  void fill(const GlProgram& program, const GlFloatMap& map) const;

  bool shadows_, occlusion_;
  GlProgram depth_, band_, reduce_, height_, floor_sky_program_, floor_light_program_;
  GlDepthMap sun_map_;
  GlFloatMap bands_, reduced_, heights_, floor_sky_, floor_light_;
  GlSampler as_depth_;  ///< reads the sun map without comparing
  GlVertexArray no_attributes_;
};

}  // namespace tactus
