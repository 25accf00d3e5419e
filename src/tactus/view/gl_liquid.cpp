#include "tactus/view/gl_liquid.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "tactus/view/gl_uniforms.h"
#include "tactus/view/liquid_shaders.h"
#include "tactus/view/shaders.h"

namespace tactus {
namespace {

/// How far the smoothed front of a crowd's balls is in front of the liquid, whose surface is half a spacing
/// from the outermost particles. The mean height of balls on a square lattice is 0.683, so it is 0.183 for a
/// plane. From a ball of ten spacings the filter takes 2 x 0.8^2 / 20 = 0.064: half of that is allowed for.
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

GlFramebuffer make_target(std::initializer_list<const GlTexture*> colors, const GlTexture* depth = nullptr) {
  GLuint name = 0;
  glCreateFramebuffers(1, &name);
  std::vector<GLenum> drawn;
  for (const GlTexture* color : colors) {
    drawn.push_back(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(drawn.size()));
    glNamedFramebufferTexture(name, drawn.back(), color->get(), 0);
  }
  if (depth != nullptr) glNamedFramebufferTexture(name, GL_DEPTH_ATTACHMENT, depth->get(), 0);
  glNamedFramebufferDrawBuffers(name, static_cast<GLsizei>(drawn.size()), drawn.data());
  return GlFramebuffer(name);
}

/// One instance each: attributes of `sizes` floats, one behind the other.
GlVertexArray make_array(std::initializer_list<GLint> sizes) {
  GLuint name = 0, attribute = 0, offset = 0;
  glCreateVertexArrays(1, &name);
  for (const GLint size : sizes) {
    glVertexArrayAttribFormat(name, attribute, size, GL_FLOAT, GL_FALSE, offset);
    glVertexArrayAttribBinding(name, attribute, 0);
    glEnableVertexArrayAttrib(name, attribute++);
    offset += static_cast<GLuint>(size) * sizeof(float);
  }
  glVertexArrayBindingDivisor(name, 0, 1);
  return GlVertexArray(name);
}

constexpr GLsizei kTilePx = 32;
/// Rays bend, so the background of a place is looked up so many pixels beside it.
constexpr GLsizei kShiftPx = 96;

}  // namespace

GlLiquid::GlLiquid(GLsizei width_px, GLsizei height_px)
    : width_px_(width_px),
      height_px_(height_px),
      ball_("liquid, balls", {shaders::kBallVertex}, {shaders::kBallFragment}),
      smooth_("liquid, smoothing", {shaders::kTileVertex}, {shaders::kLiquidSmoothFragment}),
      surface_("liquid", {shaders::kTileVertex}, {shaders::kLight, shaders::kLiquidFragment}),
      front_{make_texture(GL_R32F, width_px, height_px), make_texture(GL_R32F, width_px, height_px)},
      thickness_(make_texture(GL_R32F, width_px, height_px)),
      behind_(make_texture(GL_RGBA8, width_px, height_px)),
      depth_(make_texture(GL_DEPTH_COMPONENT32F, width_px, height_px)),
      ball_target_(make_target({&front_[0], &thickness_})),
      front_target_{make_target({&front_[0]}), make_target({&front_[1]})},
      thickness_target_(make_target({&thickness_})),
      copy_(make_target({&behind_}, &depth_)),
      ball_array_(make_array({4, 4})),
      tile_array_(make_array({2})) {
  static_assert(sizeof(LiquidBall) == 8 * sizeof(float));
}

/// Squares that the smoothed thickness of a ball may reach.
void GlLiquid::find_tiles(const LiquidProjection& view) {
  constexpr float kBlurPx = 6;
  const GLsizei across = (width_px_ + kTilePx - 1) / kTilePx, down = (height_px_ + kTilePx - 1) / kTilePx;
  is_tile_.assign(static_cast<std::size_t>(across) * static_cast<std::size_t>(down), 0);
  const auto tile_of = [](float px, GLsizei count) {
    return static_cast<GLsizei>(clamp(px / kTilePx, -1.F, static_cast<float>(count)));
  };
  for (const LiquidBall& ball : balls_) {
    Vec3f p{};
    for (int i = 0; i < 3; ++i)
      p[i] = view.eye_world(i, 0) * ball.center_m.x + view.eye_world(i, 1) * ball.center_m.y +
             view.eye_world(i, 2) * ball.center_m.z + view.eye_world(i, 3);
    const float wide_m = ball.radius_m * max(ball.stretch, 1 / std::sqrt(ball.stretch));
    const float z = -p.z - wide_m;
    if (!(z > view.near_m)) continue;
    const auto span = [&](float off_m, float tangent, GLsizei size_px, GLsizei count) {
      const float half_px = 0.5F * static_cast<float>(size_px), px_m = half_px / tangent;
      const float low = (off_m - wide_m) * px_m, high = (off_m + wide_m) * px_m;
      const float from = half_px + low / (low < 0 ? z : z + 2 * wide_m) - kBlurPx;
      const float to = half_px + high / (high > 0 ? z : z + 2 * wide_m) + kBlurPx;
      return std::array{std::max(tile_of(from, count), 0), std::min(tile_of(to, count), count - 1)};
    };
    const auto [x0, x1] = span(p.x, view.tangent_x, width_px_, across);
    const auto [y0, y1] = span(p.y, view.tangent_y, height_px_, down);
    for (GLsizei y = y0; y <= y1; ++y)
      for (GLsizei x = x0; x <= x1; ++x) is_tile_[static_cast<std::size_t>(y * across + x)] = 1;
  }
  tiles_.clear();
  for (GLsizei k = 0; k < across * down; ++k)
    if (is_tile_[static_cast<std::size_t>(k)] != 0)
      tiles_.push_back({static_cast<float>(k % across), static_cast<float>(k / across)});
}

void GlLiquid::draw_maps(const ViewLiquid& liquid, std::vector<LiquidBall> balls,
                         const LiquidProjection& view, GLuint drawn) {
  balls_ = std::move(balls);
  find_tiles(view);
  if (tiles_.empty()) return;
  if (ball_buffer_.upload(balls_.data(), balls_.size() * sizeof(LiquidBall)))
    glVertexArrayVertexBuffer(ball_array_.get(), 0, ball_buffer_.get(), 0, sizeof(LiquidBall));
  if (tile_buffer_.upload(tiles_.data(), tiles_.size() * sizeof tiles_[0]))
    glVertexArrayVertexBuffer(tile_array_.get(), 0, tile_buffer_.get(), 0, sizeof tiles_[0]);
  std::array<GLsizei, 4> part{width_px_, height_px_, 0, 0};
  for (const auto& tile : tiles_) {
    const auto x = static_cast<GLsizei>(tile[0]) * kTilePx, y = static_cast<GLsizei>(tile[1]) * kTilePx;
    part = {std::min(part[0], x), std::min(part[1], y), std::max(part[2], x + kTilePx),
            std::max(part[3], y + kTilePx)};
  }
  part = {std::max(part[0] - kShiftPx, 0), std::max(part[1] - kShiftPx, 0),
          std::min(part[2] + kShiftPx, width_px_), std::min(part[3] + kShiftPx, height_px_)};
  glBlitNamedFramebuffer(drawn, copy_.get(), part[0], part[1], part[2], part[3], part[0], part[1], part[2],
                         part[3], GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT, GL_NEAREST);
  glViewport(0, 0, width_px_, height_px_);
  glScissor(part[0], part[1], part[2] - part[0], part[3] - part[1]);
  glEnable(GL_SCISSOR_TEST);
  glDepthMask(GL_FALSE);
  glDisable(GL_DEPTH_TEST);
  draw_balls(liquid, view);
  smooth(liquid, view);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);
  glDisable(GL_SCISSOR_TEST);
}

void GlLiquid::draw_balls(const ViewLiquid& liquid, const LiquidProjection& view) {
  const GLfloat nothing[] = {0, 0, 0, 0};
  glBindFramebuffer(GL_FRAMEBUFFER, front_target_[1].get());
  glClearBufferfv(GL_COLOR, 0, nothing);
  glBindFramebuffer(GL_FRAMEBUFFER, ball_target_.get());
  glClearBufferfv(GL_COLOR, 0, nothing);
  glClearBufferfv(GL_COLOR, 1, nothing);
  glUseProgram(ball_.get());
  set(ball_, "eye_world", view.eye_world);
  set(ball_, "clip_eye", view.clip_eye);
  set(ball_, "spacing_m", liquid.spacing_m);
  set(ball_, "near_m", view.near_m);
  set(ball_, "of_depth", view.clip_eye(2, 3), view.clip_eye(2, 2));
  glBindTextureUnit(2, depth_.get());
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  glBlendEquationi(0, GL_MAX);
  glBlendEquationi(1, GL_FUNC_ADD);
  glBindVertexArray(ball_array_.get());
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(balls_.size()));
  glBlendEquation(GL_FUNC_ADD);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDisable(GL_BLEND);
}

/// The squares, with a program that has kTileVertex.
void GlLiquid::draw_tiles(const GlProgram& program) const {
  glUseProgram(program.get());
  set(program, "of_tile", static_cast<float>(kTilePx) / static_cast<float>(width_px_),
      static_cast<float>(kTilePx) / static_cast<float>(height_px_));
  glBindVertexArray(tile_array_.get());
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, static_cast<GLsizei>(tiles_.size()));
}

void GlLiquid::smooth(const ViewLiquid& liquid, const LiquidProjection& view) {
  set(smooth_, "spacing_m", liquid.spacing_m);
  set(smooth_, "px_at_1m", 0.5F * static_cast<float>(height_px_) / view.tangent_y);
  const auto pass = [&](const GlTexture& from, const GlFramebuffer& to, bool along_y) {
    glBindFramebuffer(GL_FRAMEBUFFER, to.get());
    glBindTextureUnit(2, from.get());
    set(smooth_, "step_px", along_y ? 0 : 1, along_y ? 1 : 0);
    draw_tiles(smooth_);
  };
  set(smooth_, "blurs", false);
  pass(front_[0], front_target_[1], false);
  pass(front_[1], front_target_[0], true);
  set(smooth_, "blurs", true);
  pass(thickness_, front_target_[1], false);
  pass(front_[1], thickness_target_, true);
}

void GlLiquid::draw(const ViewLiquid& liquid, const LiquidProjection& view) {
  if (tiles_.empty()) return;
  set(surface_, "world_eye", view.world_eye);
  set(surface_, "clip_eye", view.clip_eye);
  set(surface_, "eye_of_px", view.tangent_x, view.tangent_y);
  set(surface_, "middle", view.middle_x, view.middle_y);
  set(surface_, "spacing_m", liquid.spacing_m);
  set(surface_, "lift_m", kLift * liquid.spacing_m);
  set(surface_, "scattered", liquid.scattered);
  set(surface_, "absorption_1_m", liquid.absorption_1_m);
  glBindTextureUnit(2, front_[0].get());
  glBindTextureUnit(3, thickness_.get());
  glBindTextureUnit(4, behind_.get());
  draw_tiles(surface_);
}

}  // namespace tactus
