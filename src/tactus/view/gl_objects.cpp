#include "tactus/view/gl_objects.h"

#include <vector>

#include "tactus/base/error.h"
#include "tactus/view/shaders.h"

namespace tactus {
namespace {

template <class Create>
GLuint create(Create glCreate) {
  GLuint name = 0;
  glCreate(1, &name);
  return name;
}

GLuint compile(const char* what, GLenum stage, std::initializer_list<const char*> parts) {
  std::vector<const char*> sources{shaders::kVersion};
  sources.insert(sources.end(), parts);
  const GLuint shader = glCreateShader(stage);
  glShaderSource(shader, static_cast<GLsizei>(sources.size()), sources.data(), nullptr);
  glCompileShader(shader);
  GLint ok = 0;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
  if (ok == 0) {
    char log[2048] = "";
    glGetShaderInfoLog(shader, sizeof log, nullptr, log);
    glDeleteShader(shader);
    throw Error(std::string("the OpenGL driver can't compile the shader '") + what + "': " + log);
  }
  return shader;
}

void check_complete(GLuint framebuffer, const std::string& what) {
  if (const GLenum status = glCheckNamedFramebufferStatus(framebuffer, GL_FRAMEBUFFER);
      status != GL_FRAMEBUFFER_COMPLETE)
    throw Error("the OpenGL driver can't draw into " + what + " (status " + std::to_string(status) + ")");
}

}  // namespace

GlProgram::GlProgram(const char* what, std::initializer_list<const char*> vertex,
                     std::initializer_list<const char*> fragment)
    : name_(glCreateProgram()) {
  for (const auto& [stage, parts] : {std::pair{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}}) {
    const GLuint shader = compile(what, static_cast<GLenum>(stage), parts);
    glAttachShader(name_.get(), shader);
    glDeleteShader(shader);
  }
  glLinkProgram(name_.get());
  GLint ok = 0;
  glGetProgramiv(name_.get(), GL_LINK_STATUS, &ok);
  if (ok == 0) {
    char log[2048] = "";
    glGetProgramInfoLog(name_.get(), sizeof log, nullptr, log);
    throw Error(std::string("the OpenGL driver can't link the shader '") + what + "': " + log);
  }
}

GlDepthMap::GlDepthMap(GLsizei side, bool compare)
    : framebuffer(create(glCreateFramebuffers)), side_px(side) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  texture = GlTexture(name);
  glTextureStorage2D(name, 1, GL_DEPTH_COMPONENT32F, side, side);
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_BORDER);
  glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_BORDER);
  const GLfloat far_away[] = {1, 1, 1, 1};
  glTextureParameterfv(name, GL_TEXTURE_BORDER_COLOR, far_away);
  if (compare) {
    glTextureParameteri(name, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTextureParameteri(name, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  }
  glNamedFramebufferTexture(framebuffer.get(), GL_DEPTH_ATTACHMENT, name, 0);
  glNamedFramebufferDrawBuffer(framebuffer.get(), GL_NONE);
  glNamedFramebufferReadBuffer(framebuffer.get(), GL_NONE);
  check_complete(framebuffer.get(), "a depth map of " + std::to_string(side) + " px");
}

GlFloatMap::GlFloatMap(GLsizei side, GLenum format, GLint filter)
    : framebuffer(create(glCreateFramebuffers)), side_px(side) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  texture = GlTexture(name);
  const bool has_levels = filter != GL_NEAREST && filter != GL_LINEAR;
  GLsizei levels = 1;
  while (has_levels && side >> levels > 0) ++levels;
  glTextureStorage2D(name, levels, format, side, side);
  const GLint border = has_levels ? GL_CLAMP_TO_BORDER : GL_CLAMP_TO_EDGE;
  glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, filter);
  glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, filter == GL_NEAREST ? GL_NEAREST : GL_LINEAR);
  glTextureParameteri(name, GL_TEXTURE_WRAP_S, border);
  glTextureParameteri(name, GL_TEXTURE_WRAP_T, border);
  glNamedFramebufferTexture(framebuffer.get(), GL_COLOR_ATTACHMENT0, name, 0);
  check_complete(framebuffer.get(), "a map of " + std::to_string(side) + " px");
}

GlPictureTarget::GlPictureTarget(GLsizei width_px, GLsizei height_px, GLsizei samples)
    : color(create(glCreateRenderbuffers)),
      depth(create(glCreateRenderbuffers)),
      resolved_color(create(glCreateRenderbuffers)),
      resolved_depth(create(glCreateRenderbuffers)),
      framebuffer(create(glCreateFramebuffers)),
      resolved(create(glCreateFramebuffers)) {
  const GLsizei stored = samples > 1 ? samples : 0;
  glNamedRenderbufferStorageMultisample(color.get(), stored, GL_RGBA8, width_px, height_px);
  glNamedRenderbufferStorageMultisample(depth.get(), stored, GL_DEPTH_COMPONENT32F, width_px, height_px);
  glNamedRenderbufferStorage(resolved_color.get(), GL_RGBA8, width_px, height_px);
  glNamedRenderbufferStorage(resolved_depth.get(), GL_DEPTH_COMPONENT32F, width_px, height_px);
  glNamedFramebufferRenderbuffer(framebuffer.get(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color.get());
  glNamedFramebufferRenderbuffer(framebuffer.get(), GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, depth.get());
  glNamedFramebufferRenderbuffer(resolved.get(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, resolved_color.get());
  glNamedFramebufferRenderbuffer(resolved.get(), GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, resolved_depth.get());
  const std::string what = std::to_string(width_px) + "x" + std::to_string(height_px) + " px with " +
                           std::to_string(samples) + " samples";
  check_complete(framebuffer.get(), what);
  check_complete(resolved.get(), what);
}

void GlShownImage::upload(const ColorImage& image) {
  if (image.width_px != width_px_ || image.height_px != height_px_) {
    width_px_ = image.width_px;
    height_px_ = image.height_px;
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_2D, 1, &name);
    texture_ = GlTexture(name);
    glTextureStorage2D(name, 1, GL_RGB8, width_px_, height_px_);
    framebuffer_ = GlFramebuffer(create(glCreateFramebuffers));
    glNamedFramebufferTexture(framebuffer_.get(), GL_COLOR_ATTACHMENT0, name, 0);
    check_complete(framebuffer_.get(), "an image to show");
  }
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTextureSubImage2D(texture_.get(), 0, 0, 0, width_px_, height_px_, GL_RGB, GL_UNSIGNED_BYTE,
                      image.pixels.data());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
}

}  // namespace tactus
