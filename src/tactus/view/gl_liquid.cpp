#include "tactus/view/gl_liquid.h"

#include "tactus/view/gl_uniforms.h"
#include "tactus/view/liquid_shaders.h"
#include "tactus/view/shaders.h"

namespace tactus {
namespace {

/// A ball's radius, in spacings: wide enough that balls a spacing apart leave no hole between four of them.
constexpr float kRadius = 0.8F;
/// How far their smoothed front is in front of the liquid, whose surface is half a spacing from the outermost
/// particles. The mean height of balls on a square lattice is 0.683, so it is 0.183 for a plane. From a ball
/// of ten spacings the filter takes 2 x 0.8^2 / 20 = 0.064: half of that is allowed for.
constexpr float kLift = 0.15F;

GlTexture make_texture(GLenum format, GLsizei width_px, GLsizei height_px) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  glTextureStorage2D(name, 1, format, width_px, height_px);
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return GlTexture(name);
}

GlFramebuffer make_target(const GlTexture& color, const GlTexture& depth) {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  glNamedFramebufferTexture(name, GL_COLOR_ATTACHMENT0, color.get(), 0);
  glNamedFramebufferTexture(name, GL_DEPTH_ATTACHMENT, depth.get(), 0);
  return GlFramebuffer(name);
}

GlVertexArray make_array(bool instances) {
  GLuint name = 0;
  glCreateVertexArrays(1, &name);
  if (instances) {
    glVertexArrayAttribFormat(name, 0, 3, GL_FLOAT, GL_FALSE, 0);
    glVertexArrayAttribBinding(name, 0, 0);
    glEnableVertexArrayAttrib(name, 0);
    glVertexArrayBindingDivisor(name, 0, 1);
  }
  return GlVertexArray(name);
}

}  // namespace

GlLiquid::GlLiquid(GLsizei width_px, GLsizei height_px)
    : width_px_(width_px),
      height_px_(height_px),
      ball_("liquid, balls", {shaders::kBallVertex}, {shaders::kBallFragment}),
      smooth_("liquid, smoothing", {shaders::kBackgroundVertex}, {shaders::kLiquidSmoothFragment}),
      surface_("liquid", {shaders::kBackgroundVertex}, {shaders::kLight, shaders::kLiquidFragment}),
      front_{make_texture(GL_R32F, width_px, height_px), make_texture(GL_R32F, width_px, height_px)},
      thickness_(make_texture(GL_R32F, width_px, height_px)),
      behind_(make_texture(GL_RGBA8, width_px, height_px)),
      depth_(make_texture(GL_DEPTH_COMPONENT32F, width_px, height_px)),
      front_target_{make_target(front_[0], depth_), make_target(front_[1], depth_)},
      thickness_target_(make_target(thickness_, depth_)),
      copy_(make_target(behind_, depth_)),
      balls_(make_array(true)),
      no_attributes_(make_array(false)) {}

void GlLiquid::draw_maps(const ViewLiquid& liquid, const LiquidProjection& view, GLuint drawn) {
  if (positions_.upload(liquid.positions_m.data(), liquid.positions_m.size() * sizeof(Vec3f)))
    glVertexArrayVertexBuffer(balls_.get(), 0, positions_.get(), 0, sizeof(Vec3f));
  count_ = static_cast<GLsizei>(liquid.positions_m.size());
  glBlitNamedFramebuffer(drawn, copy_.get(), 0, 0, width_px_, height_px_, 0, 0, width_px_, height_px_,
                         GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT, GL_NEAREST);
  glViewport(0, 0, width_px_, height_px_);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  draw_balls(liquid, view, false);
  draw_balls(liquid, view, true);
  glDisable(GL_BLEND);
  glDisable(GL_DEPTH_TEST);
  smooth(liquid, view);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
}

void GlLiquid::draw_balls(const ViewLiquid& liquid, const LiquidProjection& view, bool adds) {
  const float radius_m = kRadius * liquid.spacing_m;
  glBindFramebuffer(GL_FRAMEBUFFER, adds ? thickness_target_.get() : front_target_[0].get());
  const GLfloat nothing[] = {0, 0, 0, 0};
  glClearBufferfv(GL_COLOR, 0, nothing);
  glUseProgram(ball_.get());
  set(ball_, "eye_world", view.eye_world);
  set(ball_, "clip_eye", view.clip_eye);
  set(ball_, "radius_m", radius_m);
  set(ball_, "near_m", view.near_m);
  set(ball_, "adds", adds);
  set(ball_, "share", 3 / (4 * kPi * kRadius * kRadius * kRadius));
  glBlendFunc(GL_ONE, GL_ONE);
  glBlendEquation(adds ? GL_FUNC_ADD : GL_MAX);
  glBindVertexArray(balls_.get());
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, count_);
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
}

void GlLiquid::smooth(const ViewLiquid& liquid, const LiquidProjection& view) {
  glUseProgram(smooth_.get());
  set(smooth_, "spacing_m", liquid.spacing_m);
  set(smooth_, "px_at_1m", 0.5F * static_cast<float>(height_px_) / view.tangent_y);
  glBindVertexArray(no_attributes_.get());
  const auto pass = [&](const GlTexture& from, const GlFramebuffer& to, bool along_y) {
    glBindFramebuffer(GL_FRAMEBUFFER, to.get());
    glBindTextureUnit(2, from.get());
    set(smooth_, "step_px", along_y ? 0 : 1, along_y ? 1 : 0);
    glDrawArrays(GL_TRIANGLES, 0, 3);
  };
  set(smooth_, "blurs", false);
  pass(front_[0], front_target_[1], false);
  pass(front_[1], front_target_[0], true);
  set(smooth_, "blurs", true);
  pass(thickness_, front_target_[1], false);
  pass(front_[1], thickness_target_, true);
}

void GlLiquid::draw(const ViewLiquid& liquid, const LiquidProjection& view) {
  set(surface_, "world_eye", view.world_eye);
  set(surface_, "clip_eye", view.clip_eye);
  set(surface_, "eye_of_px", view.tangent_x, view.tangent_y);
  set(surface_, "spacing_m", liquid.spacing_m);
  set(surface_, "lift_m", kLift * liquid.spacing_m);
  set(surface_, "scattered", liquid.scattered);
  set(surface_, "absorption_1_m", liquid.absorption_1_m);
  glBindTextureUnit(2, front_[0].get());
  glBindTextureUnit(3, thickness_.get());
  glBindTextureUnit(4, behind_.get());
  glUseProgram(surface_.get());
  glBindVertexArray(no_attributes_.get());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

}  // namespace tactus
