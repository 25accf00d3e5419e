#pragma once
/// OpenGL objects that free themselves. Internal to view/; a context is current wherever they are used.
#include <epoxy/gl.h>

#include <cstddef>
#include <initializer_list>
#include <string>
#include <utility>

#include "tactus/geom/image/image.h"

namespace tactus {

/// An object name and the call that deletes it.
template <auto kDelete>
class GlName {
 public:
  GlName() = default;
  explicit GlName(GLuint name) : name_(name) {}
  GlName(GlName&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  GlName& operator=(GlName&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~GlName() {
    if (name_ != 0) kDelete(name_);
  }
  GLuint get() const { return name_; }

 private:
  GLuint name_ = 0;
};

inline void delete_buffer(GLuint name) { glDeleteBuffers(1, &name); }
inline void delete_texture(GLuint name) { glDeleteTextures(1, &name); }
inline void delete_renderbuffer(GLuint name) { glDeleteRenderbuffers(1, &name); }
inline void delete_framebuffer(GLuint name) { glDeleteFramebuffers(1, &name); }
inline void delete_vertex_array(GLuint name) { glDeleteVertexArrays(1, &name); }
inline void delete_program(GLuint name) { glDeleteProgram(name); }

using GlTexture = GlName<delete_texture>;
using GlRenderbuffer = GlName<delete_renderbuffer>;
using GlFramebuffer = GlName<delete_framebuffer>;
using GlVertexArray = GlName<delete_vertex_array>;

/// A linked program. @throws Error with the driver's log: a driver that can't compile ours.
class GlProgram {
 public:
  GlProgram(const char* what, std::initializer_list<const char*> vertex,
            std::initializer_list<const char*> fragment);
  GLuint get() const { return name_.get(); }
  GLint operator[](const char* uniform) const { return glGetUniformLocation(name_.get(), uniform); }

 private:
  GlName<delete_program> name_;
};

/// A square depth map that is drawn into and then sampled.
struct GlDepthMap {
  GlTexture texture;
  GlFramebuffer framebuffer;
  GLsizei side_px = 0;
  /// `compare`: sampled as a shadow (GL_LEQUAL), else as a depth. Outside the map is far away.
  GlDepthMap(GLsizei side, bool compare);
};

/// A square map of floats that is drawn into and then sampled.
struct GlFloatMap {
  GlTexture texture;
  GlFramebuffer framebuffer;
  GLsizei side_px = 0;
  /// @param format GL_R32F, GL_RG32F or GL_RGBA32F @param filter GL_NEAREST, GL_LINEAR, or with mipmaps
  /// Outside the map is 0 where there are mipmaps, else the value at its rim.
  GlFloatMap(GLsizei side, GLenum format, GLint filter);
};

/// The buffers that the picture is drawn into, and the single-sampled copy that is read back.
struct GlPictureTarget {
  GlRenderbuffer color, depth, resolved_color, resolved_depth;
  GlFramebuffer framebuffer, resolved;
  /// @throws Error when the driver refuses the size or the number of samples.
  GlPictureTarget(GLsizei width_px, GLsizei height_px, GLsizei samples);
};

/// An image of the host in a framebuffer, to be copied from.
class GlShownImage {
 public:
  void upload(const ColorImage& image);
  /// Its first row is the image's.
  GLuint framebuffer() const { return framebuffer_.get(); }

 private:
  GlTexture texture_;
  GlFramebuffer framebuffer_;
  Index width_px_ = 0, height_px_ = 0;
};

}  // namespace tactus
