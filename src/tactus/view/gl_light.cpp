#include "tactus/view/gl_light.h"

#include <algorithm>
#include <cmath>

#include "tactus/view/gl_uniforms.h"
#include "tactus/view/light_shaders.h"
#include "tactus/view/shaders.h"

namespace tactus {
namespace {

constexpr GLsizei kBandsPx = 256, kReducedPx = kBandsPx / 4, kHeightsPx = 96, kFloorSkyPx = 48,
                  kFloorLightPx = 384;
constexpr float kSunTangent = 0.07F;  ///< of the key light's radius: a large lamp
constexpr float kRings = 8;           ///< of samples around a place on the ground

GlSampler plain_sampler() {
  GLuint name = 0;
  glCreateSamplers(1, &name);
  glSamplerParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glSamplerParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glSamplerParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glSamplerParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  const GLfloat far_away[] = {1, 1, 1, 1};
  glSamplerParameterfv(name, GL_TEXTURE_BORDER_COLOR, far_away);
  return GlSampler(name);
}

GlVertexArray empty_array() {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  return GlVertexArray(name);
}

}  // namespace

GlLight::GlLight(GLsizei shadow_map_px, bool occlusion)
    : shadows_(shadow_map_px > 0),
      occlusion_(occlusion),
      depth_("depth", {shaders::kSurfaceVertex}, {shaders::kDepthFragment}),
      band_("bands of heights", {shaders::kSurfaceVertex}, {shaders::kBandFragment}),
      reduce_("reduced bands", {shaders::kBackgroundVertex}, {shaders::kReduceFragment}),
      height_("heights", {shaders::kBackgroundVertex}, {shaders::kHeightFragment}),
      floor_sky_program_("sky of the ground", {shaders::kBackgroundVertex}, {shaders::kFloorSkyFragment}),
      floor_light_program_("light of the ground", {shaders::kBackgroundVertex},
                           {shaders::kFloorLightFragment}),
      sun_map_(std::max(shadow_map_px, 64), true),
      bands_(kBandsPx, GL_RG32F, GL_LINEAR),
      reduced_(kReducedPx, GL_RGBA32F, GL_LINEAR_MIPMAP_NEAREST),
      heights_(kHeightsPx, GL_RGBA32F, GL_LINEAR),
      floor_sky_(kFloorSkyPx, GL_R32F, GL_LINEAR),
      floor_light_(kFloorLightPx, GL_RG32F, GL_LINEAR),
      as_depth_(plain_sampler()),
      no_attributes_(empty_array()) {}

void GlLight::draw(std::span<const GlMesh* const> casters, const PictureLayout& layout) {
  if (shadows_) draw_sun(casters, layout);
  if (occlusion_) draw_heights(casters, layout);
  if (layout.has_ground) draw_floor(layout);
}

void GlLight::draw_sun(std::span<const GlMesh* const> casters, const PictureLayout& layout) {
  glBindFramebuffer(GL_FRAMEBUFFER, sun_map_.framebuffer.get());
  glViewport(0, 0, sun_map_.side_px, sun_map_.side_px);
  glClear(GL_DEPTH_BUFFER_BIT);
  glUseProgram(depth_.get());
  set(depth_, "view_proj", layout.sun_clip);
  glEnable(GL_DEPTH_CLAMP);  // a caster outside of the box still hides the light
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1.5F, 3);
  for (const GlMesh* mesh : casters) mesh->draw(depth_);
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDisable(GL_DEPTH_CLAMP);
}

void GlLight::fill(const GlProgram& program, const GlFloatMap& map) const {
  glBindFramebuffer(GL_FRAMEBUFFER, map.framebuffer.get());
  glViewport(0, 0, map.side_px, map.side_px);
  glUseProgram(program.get());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void GlLight::draw_heights(std::span<const GlMesh* const> casters, const PictureLayout& layout) {
  glBindFramebuffer(GL_FRAMEBUFFER, bands_.framebuffer.get());
  glViewport(0, 0, kBandsPx, kBandsPx);
  const GLfloat nothing[] = {0, -1e9F, 0, 0};
  glClearBufferfv(GL_COLOR, 0, nothing);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_DEPTH_CLAMP);
  glEnable(GL_BLEND);
  glBlendEquation(GL_MAX);
  glUseProgram(band_.get());
  set(band_, "view_proj", layout.sky_clip);
  set(band_, "floor_m", layout.floor_m);
  for (const GlMesh* mesh : casters) mesh->draw(band_);
  glBlendEquation(GL_FUNC_ADD);
  glDisable(GL_BLEND);
  glDisable(GL_DEPTH_CLAMP);
  glBindVertexArray(no_attributes_.get());
  glBindTextureUnit(6, bands_.texture.get());
  const Vec3f half_m = layout.sky_half_m;
  set(height_, "disc_step", layout.reach_m / (2 * half_m.x), layout.reach_m / (2 * half_m.y));
  set(height_, "map_px", static_cast<float>(kHeightsPx));
  fill(reduce_, reduced_);
  glGenerateTextureMipmap(reduced_.texture.get());
  glBindTextureUnit(7, reduced_.texture.get());
  fill(height_, heights_);
  glEnable(GL_DEPTH_TEST);
}

void GlLight::draw_floor(const PictureLayout& layout) {
  glDisable(GL_DEPTH_TEST);
  glBindVertexArray(no_attributes_.get());
  const Box3f& lit = layout.lit_m;
  for (const GlProgram* program : {&floor_sky_program_, &floor_light_program_}) {
    set(*program, "lit_low", lit.min.x, lit.min.z);
    set(*program, "lit_size", lit.extent().x, lit.extent().z);
  }
  if (occlusion_) {
    const Vec3f half_m = layout.sky_half_m;
    const float texel_m = 2 * max(half_m.x, half_m.y) / kReducedPx, first_m = 0.7F * texel_m;
    const float last_m = 2 * std::sqrt(half_m.x * half_m.x + half_m.y * half_m.y);
    set(floor_sky_program_, "sky_matrix", clip_to_texture() * layout.sky_clip);
    set(floor_sky_program_, "map_px", static_cast<float>(kFloorSkyPx));
    set(floor_sky_program_, "first_m", first_m);
    set(floor_sky_program_, "growth", std::pow(last_m / first_m, 1 / (kRings - 1)));
    set(floor_sky_program_, "texel_m", texel_m);
    glBindTextureUnit(6, reduced_.texture.get());
    fill(floor_sky_program_, floor_sky_);
  }
  const GlProgram& light = floor_light_program_;
  set(light, "floor_y_m", layout.floor_m);
  set(light, "sun_matrix", clip_to_texture() * layout.sun_clip);
  set(light, "sun_map_m", 2 * layout.sun_half_m.x, 2 * layout.sun_half_m.y);
  set(light, "sun_range_m", 2 * layout.sun_half_m.z);
  set(light, "sun_tangent", kSunTangent);
  set(light, "map_px", static_cast<float>(kFloorLightPx));
  set(light, "shadows", shadows_);
  set(light, "occlusion", occlusion_);
  glBindTextureUnit(0, sun_map_.texture.get());
  glBindTextureUnit(6, sun_map_.texture.get());
  glBindSampler(6, as_depth_.get());
  glBindTextureUnit(7, floor_sky_.texture.get());
  fill(light, floor_light_);
  glBindSampler(6, 0);
  glEnable(GL_DEPTH_TEST);
}

void GlLight::bind() const {
  glBindTextureUnit(0, sun_map_.texture.get());
  glBindTextureUnit(1, heights_.texture.get());
  glBindTextureUnit(5, floor_light_.texture.get());
}

void GlLight::set_uniforms(const GlProgram& program, const PictureLayout& layout) const {
  set(program, "sun", layout.sun);
  set(program, "sun_matrix", clip_to_texture() * layout.sun_clip);
  set(program, "sky_matrix", clip_to_texture() * layout.sky_clip);
  set(program, "reach_m", layout.reach_m);
  set(program, "floor_m", layout.floor_m);
  set(program, "shadows", shadows_);
  set(program, "occlusion", occlusion_);
  const float step_m = 0.008F * layout.radius_m;
  set(program, "shadow_step", step_m / (2 * layout.sun_half_m.x), step_m / (2 * layout.sun_half_m.y));
  set(program, "sun_map_m", 2 * layout.sun_half_m);
  const auto map_px = static_cast<float>(sun_map_.side_px);
  set(program, "shadow_bias_m", layout.radius_m * (0.004F + 3 / map_px));
  const Box3f& lit = layout.lit_m;
  set(program, "lit_low", lit.min.x, lit.min.z);
  set(program, "lit_size", lit.extent().x, lit.extent().z);
}

}  // namespace tactus
